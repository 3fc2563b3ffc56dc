// The page of a result: one selection, shown in the workpiece, the curves, the program and the details.
import plotStyle from "uplot/dist/uPlot.min.css";
import { Bus } from "./bus.js";
import { deviationScale, scaleOf } from "./colours.js";
import { contactPane } from "./contact.js";
import { curves } from "./curves.js";
import { formatted, rowOf, unpack } from "./data.js";
import { programPane } from "./program.js";
import { sceneOf } from "./scene.js";
import { theme } from "./theme.js";
import { view } from "./view.js";

const one = (selector) => document.querySelector(selector);

async function start() {
  const sheet = document.createElement("style");
  sheet.textContent = plotStyle;
  document.head.append(sheet);
  const data = await unpack(one("#data").textContent.trim());
  if (data.scene) {
    theme();
    document.documentElement.dataset.ready = sceneOf(one("#view"), data) ? "3d" : "flat";
    return;
  }
  data.rows = data.arrays.block.length;
  const bus = new Bus(data.rows);

  // -- what the colours mean
  const choice = one("#colour"), logarithmic = one("#log");
  for (const { name, label, unit } of data.loads) choice.append(new Option(unit ? `${label}, ${unit}` : label, name));
  choice.value = data.loads[0].name;
  logarithmic.checked = false;
  const load = () => {
    const chosen = data.loads.find((entry) => entry.name === choice.value);
    if (chosen.reach) return { values: worst(chosen.name), vertices: data.arrays[chosen.name], scale: deviationScale(chosen.reach), title: chosen.label, unit: chosen.unit };
    const values = data.arrays[chosen.name];
    return { values, scale: scaleOf(values, logarithmic.checked && chosen.name !== "block"), title: chosen.label, unit: chosen.unit };
  };
  // of every row the largest deviation on the faces that it made
  let found = null;
  function worst(name) {
    if (found) return found;
    const { triangles, face_block: made, block } = data.arrays, values = data.arrays[name];
    found = new Float32Array(data.rows).fill(NaN);
    for (let f = 0; f < made.length; f++) {
      if (made[f] < 0) continue;
      const row = rowOf(block, made[f]);
      for (let c = 0; c < 3; c++) {
        const v = values[triangles[3 * f + c]];
        if (!(Math.abs(v) <= Math.abs(found[row]))) found[row] = v;
      }
    }
    return found;
  }
  function legend() {
    const { scale, unit } = load();
    const ramp = one("#ramp");
    ramp.style.background = `linear-gradient(90deg, ${[0, 0.2, 0.4, 0.6, 0.8, 1].map((s) => `rgb(${scale.colour(s).map(Math.round).join(",")})`).join(", ")})`;
    one("#ramp-low").textContent = formatted(scale.low, 3);
    one("#ramp-high").textContent = `${formatted(scale.high, 4)} ${unit}`;
  }

  const workpiece = view(one("#view"), data, bus, load);
  const program = programPane(one("#program"), data, bus, load);
  const plotted = curves(one("#curves"), data, bus);
  if (data.contact?.length) contactPane(one("#contact"), data, bus);
  legend();
  const recolour = () => { legend(); workpiece?.recolour(); program.recolour(); };
  choice.addEventListener("change", recolour);
  logarithmic.addEventListener("change", recolour);

  // -- details of the marked block
  function details() {
    const row = bus.row;
    one("#details").hidden = row < 0;
    if (row < 0) return;
    const { arrays } = data;
    one("#details-title").textContent = `Block ${arrays.block[row]}, line ${arrays.line[row]}`;
    one("#details-text").textContent = data.texts[row];
    const list = one("#details-values");
    list.replaceChildren();
    for (const { name, label, unit } of data.details) {
      const value = arrays[name][row];
      if (!Number.isFinite(value)) continue;
      const item = document.createElement("div");
      const term = document.createElement("dt"), text = document.createElement("dd");
      term.textContent = label;
      text.textContent = name === "removed_mm3"
        ? `${formatted(value, 6)} mm³, between ${formatted(arrays.removed_lo_mm3[row], 6)} and ${formatted(arrays.removed_hi_mm3[row], 6)}`
        : `${formatted(value)} ${unit}`;
      item.append(term, text);
      list.append(item);
    }
    one("#details-warning").textContent = data.warnings[arrays.block[row]] ?? "";
  }
  bus.listen((kind) => { if (kind === "row") details(); });

  // -- play
  const slider = one("#slider"), button = one("#play"), place = one("#place"), speed = one("#speed");
  slider.max = String(data.rows);
  slider.step = data.rows > 5000 ? "1" : "0.05";
  slider.value = slider.max;
  let timer = 0, before = 0;
  function said() {
    const row = Math.floor(bus.at);
    place.textContent = bus.at >= data.rows ? "finished part" : `block ${data.arrays.block[row]} of ${data.arrays.block[data.rows - 1]}`;
    slider.setAttribute("aria-valuetext", place.textContent);
  }
  function tick(now) {
    const seconds = Math.min(0.1, (now - before) / 1000);
    before = now;
    const row = Math.floor(bus.at);
    // blocks at the pace of the machine, times the factor; what takes no time passes at once
    const took = Math.max(1e-3, data.arrays.time_s[row] || 0);
    const pace = speed.value === "blocks" ? data.rows / 20 : Number(speed.value) / took;
    bus.play(bus.at + Math.min(pace * seconds, data.rows / 50 + 1), "timer");
    if (bus.at >= data.rows) return stop();
    timer = requestAnimationFrame(tick);
  }
  function stop() {
    cancelAnimationFrame(timer);
    timer = 0;
    button.textContent = "Play";
    button.setAttribute("aria-pressed", "false");
    bus.tell("rest");
  }
  function toggle() {
    if (timer) return stop();
    if (bus.at >= data.rows) bus.play(0, "timer");
    before = performance.now();
    button.textContent = "Pause";
    button.setAttribute("aria-pressed", "true");
    timer = requestAnimationFrame(tick);
  }
  button.addEventListener("click", toggle);
  slider.addEventListener("input", () => { stop(); bus.play(Number(slider.value), "slider"); });
  bus.listen((kind, source) => {
    if (kind === "at" && source !== "slider") slider.value = String(bus.at);
    if (kind === "at") said();
  });
  slider.addEventListener("change", () => bus.tell("rest"));
  one("#to-marked").addEventListener("click", () => { stop(); bus.play(bus.row >= 0 ? bus.row + 1 - 1e-6 : data.rows, "button"); });
  one("#to-end").addEventListener("click", () => { stop(); bus.play(data.rows, "button"); });
  said();

  one("#machine").hidden = !data.machine;
  for (const box of document.querySelectorAll("[data-show]")) box.addEventListener("change", () => workpiece?.show(box.dataset.show, box.checked));
  one("#home").addEventListener("click", () => workpiece?.home());
  document.addEventListener("click", (event) => {
    const jump = event.target.closest("[data-block]");
    if (!jump) return;
    event.preventDefault();
    bus.select(rowOf(data.arrays.block, Number(jump.dataset.block)), "table");
    one("#work").scrollIntoView({ block: "start", behavior: "smooth" });
  });
  document.addEventListener("keydown", (event) => {
    if (/^(INPUT|SELECT|TEXTAREA|BUTTON|SUMMARY|A)$/.test(event.target.tagName)) return;
    if (event.key === " ") { event.preventDefault(); toggle(); }
    if (event.key === "ArrowRight") bus.select(bus.row + 1, "keys");
    if (event.key === "ArrowLeft") bus.select(Math.max(0, bus.row - 1), "keys");
    if (event.key === "Escape") bus.select(-1, "keys");
  });

  theme(() => plotted.draw());
  // -- a run in hand: its rows as they are made, and the part as cut so far
  if (data.live) {
    let next = 0;
    const ask = async () => {
      try {
        const { rows } = await (await fetch(`rows.json?from=${next}`, { cache: "no-store" })).json();
        if (rows.length) {
          for (const [block, removed, lo, hi, rate] of rows) {
            const row = rowOf(data.arrays.block, block);
            data.arrays.removed_mm3[row] = removed;
            data.arrays.removed_lo_mm3[row] = lo;
            data.arrays.removed_hi_mm3[row] = hi;
            data.arrays.mrr_mm3_min[row] = rate ?? NaN;
          }
          next = rows.at(-1)[0] + 1;
          recolour();
          plotted.draw();
          if (!timer) bus.play(rowOf(data.arrays.block, next - 1) + 1 - 1e-6, "run");
        }
      } catch { return; } // the server has ended, and the frame around this page says so
      setTimeout(ask, 700);
    };
    bus.play(0, "run");
    ask();
  }
  document.documentElement.dataset.ready = workpiece ? "3d" : "flat";
}

start().catch((error) => {
  document.documentElement.dataset.ready = "failed";
  one("#view-note").textContent = `The interactive part of this page did not start (${error.message}); every number is on the page and in blocks.parquet.`;
  console.error(error);
});
