// What the tool touches at the largest chip of a block: the map over rotation and edge, the section of that chip, force over a turn.
import { viridis } from "./colours.js";
import { formatted, rowOf } from "./data.js";

const CELLS = 48, WIDTH = 400, HEIGHT = 250, LEFT = 52, RIGHT = 14, TOP = 8, BOTTOM = 40;
const SVG = "http://www.w3.org/2000/svg";

function svg(name, attributes, parent, text) {
  const made = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  if (text !== undefined) made.textContent = text;
  parent?.append(made);
  return made;
}

function ticks(low, high, count) {
  const raw = (high - low) / count, size = 10 ** Math.floor(Math.log10(raw));
  const step = size * [1, 2, 2.5, 5, 10].find((f) => size * f >= raw * (1 - 1e-9));
  const first = Math.ceil(low / step - 1e-9);
  return [...Array(Math.floor(high / step + 1e-9) - first + 1).keys()].map((k) => (first + k) * step);
}

// Axes from `low` to x and y with their words; hands out the picture and its two scales.
function axes(root, title, words, { x, y, xs, ys, low = 0 }) {
  const figure = document.createElement("figure"), caption = document.createElement("figcaption");
  caption.textContent = title;
  const picture = svg("svg", { viewBox: `0 0 ${WIDTH} ${HEIGHT}`, role: "img", "aria-label": words, "font-size": 12, fill: "var(--muted)" });
  const across = (v) => LEFT + (v / x) * (WIDTH - LEFT - RIGHT), up = (v) => HEIGHT - BOTTOM - ((v - low) / (y - low)) * (HEIGHT - TOP - BOTTOM);
  for (const v of ticks(low, y, 5)) {
    svg("path", { d: `M${LEFT} ${up(v)}H${WIDTH - RIGHT}`, stroke: "var(--grid)" }, picture);
    svg("text", { x: LEFT - 6, y: up(v) + 4, "text-anchor": "end" }, picture, formatted(v, 3));
  }
  for (const v of x === 360 ? [0, 90, 180, 270, 360] : ticks(0, x, 4)) {
    svg("path", { d: `M${across(v)} ${TOP}V${HEIGHT - BOTTOM}`, stroke: "var(--grid)" }, picture);
    svg("text", { x: across(v), y: HEIGHT - BOTTOM + 15, "text-anchor": "middle" }, picture, formatted(v, 3));
  }
  svg("text", { x: (LEFT + WIDTH - RIGHT) / 2, y: HEIGHT - 6, "text-anchor": "middle" }, picture, xs);
  svg("text", { transform: `translate(12 ${(HEIGHT - BOTTOM + TOP) / 2}) rotate(-90)`, "text-anchor": "middle" }, picture, ys);
  figure.append(caption, picture);
  root.append(figure);
  return { picture, across, up };
}

export function contactPane(root, data, bus) {
  const { contact, arrays } = data;
  const said = document.querySelector("#contact-said");

  // the map as a picture: a column of cells for every angle, in two pieces where it reaches over 360 degrees
  function painted(record) {
    const canvas = document.createElement("canvas"), n = record.angles;
    canvas.width = 720;
    canvas.height = CELLS;
    const ctx = canvas.getContext("2d"), wide = canvas.width / n;
    for (let k = 0; k < n; k++) {
      const at = ((90 + (360 * k) / n) % 360) * 2 - wide / 2;
      for (let c = 0; c < CELLS; c++) {
        const level = arrays.contact_maps[record.map + k * CELLS + c];
        if (!level) continue;
        ctx.fillStyle = `rgb(${viridis((level - 1) / 254).map(Math.round).join(",")})`;
        for (const x of at < 0 ? [at, at + canvas.width] : [at]) ctx.fillRect(Math.floor(x), CELLS - 1 - c, Math.ceil(wide), 1);
      }
    }
    return canvas.toDataURL();
  }

  function draw() {
    const best = bus.row < 0 ? contact.reduce((a, b) => (b.load > a.load ? b : a)) : contact.find((r) => rowOf(arrays.block, r.block) === bus.row && arrays.block[bus.row] === r.block);
    root.replaceChildren();
    if (!best) {
      const block = arrays.block[bus.row];
      said.textContent = arrays.ap_mm?.[bus.row] > 0
        ? `The page holds maps of ${contact.length} blocks and not of block ${block}. \u201cvmachining engage ${data.job} --block ${block} --out contact\u201d makes its map.`
        : `The tool touches nothing in block ${block}, or its contact was not computed.`;
      return;
    }
    const { angles, low, high, top, unit, fed, at } = best;
    const thick = (k, c) => Math.max(0, arrays.contact_maps[best.map + k * CELLS + c] - 1) / 254 * top;
    const sums = [...Array(angles).keys()].map((k) => { let sum = 0; for (let c = 0; c < CELLS; c++) sum += thick(k, c); return (sum * (high - low)) / CELLS; });
    const worst = sums.indexOf(Math.max(...sums)), degrees = (k) => (90 + (360 * k) / angles) % 360;
    said.textContent = `Block ${best.block}, at ${formatted(100 * at, 3)} % of its path, where its chip is largest${bus.row < 0 ? "; mark another block to see it here" : ""}. `
      + `Colours run from 0 to a chip thickness of ${formatted(top, 3)} ${unit}.`;
    const turned = fed ? "rotation from the feed, degrees (90: straight ahead)" : "rotation of the tool, degrees";
    const map = axes(root, "Where the edge cuts", `Chip thickness of block ${best.block} over rotation and height along the edge`, { x: 360, y: high, low, xs: turned, ys: "along the edge, mm" });
    const picture = svg("image", { x: LEFT, y: TOP, width: WIDTH - LEFT - RIGHT, height: HEIGHT - TOP - BOTTOM, preserveAspectRatio: "none", href: painted(best), style: "image-rendering:pixelated" });
    map.picture.prepend(picture);
    const chip = axes(root, `The largest chip of a tooth, at ${formatted(degrees(worst), 3)}°`, `Chip thickness along the edge at ${formatted(degrees(worst), 3)} degrees, block ${best.block}`, { x: 1.15 * top || 1, y: high, low, xs: `chip thickness, ${unit}`, ys: "along the edge, mm" });
    let way = `M${chip.across(0)} ${chip.up(low)}`;
    for (let c = 0; c < CELLS; c++) { // cells are steps
      const h = chip.across(thick(worst, c)), z0 = chip.up(low + (c * (high - low)) / CELLS), z1 = chip.up(low + ((c + 1) * (high - low)) / CELLS);
      way += `L${h} ${z0}L${h} ${z1}`;
    }
    svg("path", { d: `${way}L${chip.across(0)} ${chip.up(high)}Z`, fill: "var(--band)", stroke: "var(--first)", "stroke-width": 1.5 }, chip.picture);
    const forces = best.turn === null ? null : arrays.contact_turns.subarray(best.turn, best.turn + angles);
    const over = forces ? [...forces].map((v, k) => [(360 * k) / angles, v]) : sums.map((v, k) => [degrees(k), v]).sort((a, b) => a[0] - b[0]);
    over.push([360, over[0][1]]);
    const largest = Math.max(...over.map(([, v]) => v)) || 1;
    const title = forces ? `Force on the tool over a turn, ${best.teeth} ${best.teeth === 1 ? "tooth" : "teeth"}` : "Chip area of one tooth over a turn";
    const turn = axes(root, title, `${title}, block ${best.block}`, { x: 360, y: 1.1 * largest, xs: turned, ys: forces ? "N" : unit === "mm" ? "mm²" : "mm² per mm of feed" });
    svg("path", { d: over.map(([x, y], k) => `${k ? "L" : "M"}${turn.across(x)} ${turn.up(y)}`).join(""), fill: "none", stroke: `var(--${forces ? "fourth" : "after"})`, "stroke-width": 1.8 }, turn.picture);
  }
  bus.listen((kind) => { if (kind === "row") draw(); });
  draw();
}
