"use strict";
(function () {
  const data = JSON.parse(document.getElementById("figures").textContent);
  const config = {responsive: true, displaylogo: false,
                  modeBarButtonsToRemove: ["select2d", "lasso2d", "autoScale2d"]};
  const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer;
  const toggle = function (name, act) {
    const buttons = Array.from(document.querySelectorAll("[data-" + name + "]"));
    for (const button of buttons) {
      button.addEventListener("click", function () {
        for (const other of buttons) other.setAttribute("aria-pressed", String(other === button));
        act(button.dataset[name]);
      });
    }
  };
  const view = document.getElementById("view");
  const plots = document.getElementById("plots");
  if (plots.clientWidth < 560) {
    Object.assign(data.plots.layout.margin, {l: 58, r: 8, t: 104});
    Object.assign(data.plots.layout.legend, {x: 0, xanchor: "left", y: 1.03});
  }
  const {labels, each} = data.plots.layout.meta;
  const texts = labels.flatMap((label) => Array(each).fill(label));
  for (const trace of data.plots.data) if (trace.hovertemplate) trace.text = texts;
  Plotly.newPlot(plots, data.plots.data, data.plots.layout, config);
  const contact = document.getElementById("contact");
  if (contact) {
    const same = data.contact.layout.meta;
    const told = same.labels.flatMap((label) => Array(same.each).fill(label));
    for (const trace of data.contact.data) trace.text = told;
    const blocks = data.contact.data.map((trace) => trace.x);
    Plotly.newPlot(contact, data.contact.data, data.contact.layout, config);
    const last = Math.max(...Object.keys(data.contact.layout).filter((key) => key.startsWith("xaxis"))
      .map((key) => Number(key.slice(5) || 1)));
    toggle("along", function (what) {
      const x = what === "time" ? blocks.map(() => same.time) : blocks;
      const title = what === "time" ? "time as programmed, s" : "block";
      Plotly.update(contact, {x}, {["xaxis" + (last > 1 ? last : "") + ".title.text"]: title});
    });
  }

  view.textContent = "";
  const scene = data.stock.layout.scene.aspectratio;
  const narrow = Math.min(1, view.clientWidth / view.clientHeight / 1.7);  // the scene is sized by its height
  for (const axis of "xyz") scene[axis] *= narrow;
  if (view.clientWidth < 560) {
    data.stock.data[data.cut_trace].colorbar.len = 0.5;
    data.stock.layout.legend.font.size = 10;
  }
  const face = new Int32Array(bytes(data.face_block));
  data.stock.data[data.cut_trace].intensity = Array.from(face);
  Plotly.newPlot(view, data.stock.data, data.stock.layout, config).catch(function () {
    view.textContent = "This browser shows no WebGL, so there is no 3-D view; every number is below.";
  });
  const rates = {rate: new Float32Array(bytes(data.block_rate))};
  if (data.block_rate_after) rates.after = new Float32Array(bytes(data.block_rate_after));
  const top = Object.values(rates).reduce((a, r) => r.reduce((m, v) => Math.max(m, v), a), 0);
  const heat = ["#0d0887", "#6a00a8", "#b12a90", "#e16462", "#fca636", "#f0f921"].map((c, k) => [k / 5, c]);
  const coloured = (values, title, scale, range) => ({
    intensity: [values], "colorbar.title.text": [title], colorscale: [scale], cmin: [range[0]], cmax: [range[1]],
  });
  const span = face.reduce((r, b) => [Math.min(r[0], b), Math.max(r[1], b)], [Infinity, -Infinity]);
  const colours = (what) => what === "block"
    ? coloured(Array.from(face), "block", "Viridis", span)
    : coloured(Array.from(face, (b) => rates[what][b]), "mm³/min", heat, [0, top]);
  toggle("colour", (what) => Plotly.restyle(view, colours(what), [data.cut_trace]));
})();
