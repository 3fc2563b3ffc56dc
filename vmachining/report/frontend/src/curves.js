// Curves along the program: steps per block with the bracket as a band, over block, path length or time.
import uPlot from "uplot";
import { formatted, rowOf } from "./data.js";

const HEIGHT = 118;

export function curves(root, data, bus) {
  const { arrays, rows, curves: wanted } = data;
  const plots = [];
  let along = "block";

  const style = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

  function axis() {
    if (along === "block") return Float64Array.from(arrays.block, (b) => b);
    return Float64Array.from(arrays[along === "time" ? "begin_s" : "begin_mm"], (v) => v);
  }

  function draw() {
    for (const plot of plots.splice(0)) plot.destroy();
    root.replaceChildren();
    const x = axis();
    const end = along === "block" ? arrays.block[rows - 1] + 1 : data.ends[along];
    const xs = [...x, end];
    wanted.forEach((curve, index) => {
      const last = index === wanted.length - 1;
      const series = [{ label: { block: "block", length: "path mm", time: "time s" }[along] }];
      const columns = [xs];
      const stepped = uPlot.paths.stepped({ align: 1 });
      for (const line of curve.lines) {
        const values = arrays[line.name];
        const column = Array.from(values, (v) => (Number.isFinite(v) ? v : null));
        columns.push([...column, null]);
        series.push({
          label: line.label, stroke: line.hidden ? "transparent" : style(line.colour), width: line.hidden ? 0 : 1.4, paths: stepped,
          points: { show: false }, spanGaps: false,
        });
      }
      const bands = curve.band ? [{ series: curve.band, fill: style("--band") }] : undefined;
      const box = document.createElement("figure");
      const title = document.createElement("figcaption");
      title.textContent = `${curve.title}, ${curve.unit}`;
      const shown = curve.lines.filter((line) => !line.hidden);
      for (const line of shown.length > 1 ? shown : []) {
        const key = document.createElement("span"), dash = document.createElement("i");
        dash.style.background = `var(${line.colour})`;
        key.append(dash, line.label);
        title.append(key);
      }
      const value = document.createElement("output");
      title.append(value);
      box.append(title);
      root.append(box);
      const plot = new uPlot({
        width: root.clientWidth, height: HEIGHT + (last ? 22 : 0),
        legend: { show: false }, bands, series,
        cursor: { sync: { key: "program" }, y: false, drag: { x: true, y: false }, points: { show: false } },
        scales: { x: { time: false, range: (self, low, high) => (low === high ? [low - 1, high + 1] : [low, high]) },
          y: curve.log ? { distr: 4, asinh: curve.log, range: (self, low, high) => [0, Math.max(10 * curve.log, high ?? 0) * 1.3] } : { range: (self, low, high) => [Math.min(0, low ?? 0), (high ?? 0) > 0 ? high * 1.06 : 1] } },
        axes: [
          { show: true, size: last ? 42 : 20, stroke: style("--muted"), grid: { stroke: style("--grid"), width: 1 }, ticks: { show: false },
            label: last ? { block: "block", length: "path length, mm", time: "time, s" }[along] : undefined, labelSize: 16, labelFont: "12px sans-serif", font: "11px sans-serif",
            values: last ? undefined : (self, ticks) => ticks.map(() => "") },
          { size: 62, stroke: style("--muted"), grid: { stroke: style("--grid"), width: 1 }, ticks: { show: false }, font: "11px sans-serif",
            splits: curve.log ? (self, i, low, high) => [0, ...[...Array(6).keys()].map((k) => curve.log * 10 ** (2 * k + 1)).filter((v) => v <= high)] : undefined,
            filter: (self, ticks) => ticks,
            values: (self, ticks) => ticks.map((tick) => (tick === null ? "" : formatted(tick, 3))) },
        ],
        hooks: {
          drawClear: [(self) => { mark(self); if (self.over.querySelector(".now")) stand(self); }],
          init: [(self) => { self.over.append(Object.assign(document.createElement("i"), { className: "now", hidden: true })); }],
          setCursor: [(self) => {
            const k = self.cursor.idx;
            if (k === null || k === undefined || k >= rows) { value.textContent = ""; return; }
            const row = stepAt(xs, self.posToVal(self.cursor.left, "x"));
            value.textContent = `block ${arrays.block[row]}: ` + curve.lines.filter((line) => !line.hidden)
              .map((line) => `${curve.lines.length > 1 ? line.label + " " : ""}${formatted(arrays[line.name][row])}`).join(" · ");
          }],
        },
      }, columns, box);
      plot.over.addEventListener("click", () => {
        if (plot.select.width > 3) return;
        bus.select(stepAt(xs, plot.posToVal(plot.cursor.left, "x")), "curves");
      });
      plots.push(plot);
    });
  }

  const stepAt = (xs, value) => {
    let low = 0, high = rows - 1;
    while (low < high) { const middle = (low + high + 1) >> 1; if (xs[middle] <= value) low = middle; else high = middle - 1; }
    return low;
  };

  function mark(plot) {
    const { ctx, bbox } = plot, xs = plot.data[0];
    const span = (a, b, colour) => {
      const left = plot.valToPos(a, "x", true), right = plot.valToPos(b, "x", true);
      ctx.save();
      ctx.fillStyle = colour;
      ctx.fillRect(left, bbox.top, Math.max(2, right - left), bbox.height);
      ctx.restore();
    };
    if (bus.row >= 0) span(xs[bus.row], xs[bus.row + 1], style("--mark"));
  }

  // where the played cut stands: a line of its own above the curves, which need not be drawn again for it
  function stand(plot) {
    const line = plot.over.querySelector(".now"), xs = plot.data[0], k = Math.floor(bus.at);
    line.hidden = bus.at >= bus.count;
    if (!line.hidden) line.style.transform = `translateX(${plot.valToPos(xs[k] + (bus.at - k) * (xs[k + 1] - xs[k]), "x")}px)`;
  }
  let waiting = 0;
  bus.listen((kind) => {
    if (kind === "at") for (const plot of plots) stand(plot);
    if (kind !== "row" || waiting) return;
    waiting = setTimeout(() => { waiting = 0; for (const plot of plots) plot.redraw(false, true); }, 0);
  });
  for (const button of document.querySelectorAll("[data-along]")) {
    button.addEventListener("click", () => {
      along = button.dataset.along;
      for (const other of document.querySelectorAll("[data-along]")) other.setAttribute("aria-pressed", String(other === button));
      draw();
    });
  }
  new ResizeObserver(() => { for (const plot of plots) plot.setSize({ width: root.clientWidth, height: plot.height }); }).observe(root);
  draw();
  return { draw, rowOf };
}
