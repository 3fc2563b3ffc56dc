"use strict";
(function () {
  const data = JSON.parse(document.getElementById("figures").textContent);
  const config = {responsive: true, displaylogo: false,
                  modeBarButtonsToRemove: ["select2d", "lasso2d", "autoScale2d"]};
  const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer;
  const view = document.getElementById("view");
  const plots = document.getElementById("plots");
  Plotly.newPlot(plots, data.plots.data, data.plots.layout, config);

  view.textContent = "";
  Plotly.newPlot(view, data.stock.data, data.stock.layout, config).catch(function () {
    view.textContent = "This browser shows no WebGL, so there is no 3-D view; every number is below.";
  });
  const face = new Int32Array(bytes(data.face_block));
  const rate = new Float32Array(bytes(data.block_rate));
  const heat = ["#0d0887", "#6a00a8", "#b12a90", "#e16462", "#fca636", "#f0f921"].map((c, k) => [k / 5, c]);
  const colours = {
    block: () => ({intensity: [Array.from(face)], "colorbar.title.text": ["block"], colorscale: ["Viridis"]}),
    rate: () => ({intensity: [Array.from(face, (b) => rate[b])], "colorbar.title.text": ["mm³/min"],
                  colorscale: [heat]}),
  };
  const buttons = Array.from(document.querySelectorAll("[data-colour]"));
  for (const button of buttons) {
    button.addEventListener("click", function () {
      for (const other of buttons) other.setAttribute("aria-pressed", String(other === button));
      Plotly.restyle(view, colours[button.dataset.colour](), [data.cut_trace]);
    });
  }
})();
