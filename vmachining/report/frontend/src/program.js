// The program with a bar of load beside each block. Only the lines in sight are in the document.
import { formatted } from "./data.js";

const HEIGHT = 22, PAUSE_MS = 150;

export function programPane(root, data, bus, load) {
  const { arrays, texts, source, rows } = data;
  const lines = [];   // [row or -1, line number, text]
  const place = new Int32Array(rows);
  let previous = 0;
  for (let row = 0; row < rows; row++) {
    const line = arrays.line[row];
    // lines that move nothing stand between the blocks, where the program runs on without a jump
    if (source && line > previous && line - previous <= 200) {
      for (let k = previous + 1; k < line; k++) lines.push([-1, k, source[k - 1] ?? ""]);
    } else if (!source && row > 0 && arrays.block[row] > arrays.block[row - 1] + 1) {
      lines.push([-1, "", `… ${arrays.block[row] - arrays.block[row - 1] - 1} blocks between`]);
    }
    place[row] = lines.length;
    lines.push([row, line, texts[row]]);
    previous = line;
  }
  if (source) for (let k = previous + 1; k <= Math.min(source.length, previous + 200); k++) lines.push([-1, k, source[k - 1]]);

  const inner = document.createElement("div");
  inner.className = "lines";
  inner.style.height = `${lines.length * HEIGHT}px`;
  root.append(inner);
  root.tabIndex = 0;
  let { values, scale, title } = load();

  function draw() {
    const first = Math.max(0, Math.floor(root.scrollTop / HEIGHT) - 4);
    const last = Math.min(lines.length, first + Math.ceil(root.clientHeight / HEIGHT) + 8);
    inner.replaceChildren();
    const playing = bus.at < bus.count ? Math.floor(bus.at) : -1;
    for (let k = first; k < last; k++) {
      const [row, line, text] = lines[k];
      const item = document.createElement("div");
      item.className = row < 0 ? "line still" : "line";
      if (row >= 0 && row === bus.row) item.classList.add("marked");
      if (row >= 0 && row === playing) item.classList.add("playing");
      item.style.top = `${k * HEIGHT}px`;
      const number = document.createElement("span");
      number.className = "no";
      number.textContent = line;
      const code = document.createElement("span");
      code.className = "code";
      code.textContent = text;
      const bar = document.createElement("span");
      bar.className = "load";
      if (row >= 0) {
        const share = scale.share(values[row]);
        if (share !== null && (values[row] > 0 || scale.low < 0)) {
          const fill = document.createElement("i");
          fill.style.width = `${(100 * Math.max(0.015, scale.low < 0 ? Math.abs(2 * share - 1) : share)).toFixed(1)}%`;
          fill.style.background = `rgb(${scale.colour(share).map(Math.round).join(",")})`;
          bar.append(fill);
          item.title = `block ${arrays.block[row]}: ${title} ${formatted(values[row])}`;
        }
        if (arrays.warned[row]) item.classList.add("warned");
        item.addEventListener("click", () => { root.focus(); bus.select(row, "program"); });
      }
      item.append(number, bar, code);
      inner.append(item);
    }
  }

  function reveal(row) {
    const top = place[row] * HEIGHT;
    if (top < root.scrollTop + HEIGHT || top > root.scrollTop + root.clientHeight - 2 * HEIGHT) root.scrollTop = top - root.clientHeight / 3;
  }

  root.addEventListener("scroll", () => requestAnimationFrame(draw));
  root.addEventListener("keydown", (event) => {
    const step = { ArrowDown: 1, ArrowUp: -1, PageDown: 20, PageUp: -20, Home: -rows, End: rows }[event.key];
    if (step === undefined) return;
    event.preventDefault();
    bus.select(Math.max(0, bus.row + step), "keys");
  });
  let waiting = 0;
  bus.listen((kind, source) => {
    if (kind === "row" && bus.row >= 0 && source !== "program") reveal(bus.row);
    if (kind === "row") draw();
    if (waiting) return;
    waiting = setTimeout(() => { // while the cut is played the program follows in steps
      waiting = 0;
      if (bus.at < bus.count) reveal(Math.floor(bus.at));
      draw();
    }, PAUSE_MS);
  });
  new ResizeObserver(draw).observe(root);
  draw();
  return { recolour() { ({ values, scale, title } = load()); draw(); } };
}
