// The table of a batch: its heads sort, words filter, and the last line sums what is shown.
import { formatted } from "./data.js";
import { theme } from "./theme.js";

const table = document.querySelector("#jobs"), words = document.querySelector("#filter"), only = document.querySelector("#warned");
const heads = table ? [...table.tHead.rows[0].cells] : [], body = table?.tBodies[0];
const keyOf = (row, at) => row.cells[at].dataset.key;

for (const head of heads) {
  head.querySelector("button")?.addEventListener("click", () => {
    const up = head.getAttribute("aria-sort") !== "ascending", at = head.cellIndex, sign = up ? 1 : -1;
    for (const other of heads) other.removeAttribute("aria-sort");
    head.setAttribute("aria-sort", up ? "ascending" : "descending");
    const order = at ? (a, b) => keyOf(a, at) - keyOf(b, at) : (a, b) => keyOf(a, at).localeCompare(keyOf(b, at), undefined, { numeric: true });
    body.append(...[...body.rows].sort((a, b) => sign * order(a, b)));
  });
}

function time(seconds) { // as numbers.py writes durations
  if (seconds < 120) return `${seconds.toFixed(2)} s`;
  const tenths = Math.round(10 * seconds), whole = Math.round(seconds), two = (v) => String(v).padStart(2, "0");
  if (seconds < 7200) return `${Math.floor(tenths / 600)}:${((tenths % 600) / 10).toFixed(1).padStart(4, "0")} min`;
  return `${Math.floor(whole / 3600)}:${two(Math.floor((whole % 3600) / 60))}:${two(whole % 60)} h`;
}

function show() {
  const asked = words.value.trim().toLowerCase().split(/\s+/), warned = heads.findIndex((head) => head.dataset.is === "warnings");
  for (const row of body.rows) {
    const text = `${row.cells[0].textContent} ${row.cells[0].title}`.toLowerCase();
    row.hidden = !asked.every((word) => text.includes(word)) || (only.checked && !(Number(keyOf(row, warned)) > 0));
  }
  const shown = [...body.rows].filter((row) => !row.hidden), foot = table.tFoot.rows[0];
  const sum = (at, name = "key") => shown.reduce((total, row) => total + Math.max(0, Number(row.cells[at].dataset[name] ?? 0)), 0);
  foot.cells[0].textContent = `${shown.length} of ${body.rows.length} jobs`;
  heads.forEach((head, at) => {
    const text = {
      count: () => formatted(sum(at), 7), volume: () => formatted(sum(at), 7), seconds: () => time(sum(at)), warnings: () => formatted(sum(at), 7),
      bracket: () => `${formatted(sum(at), 7)} … ${formatted(sum(at, "high"), 7)}`,
    }[head.dataset.is];
    if (text) foot.cells[at].textContent = shown.length ? text() : "";
  });
}

if (table) {
  for (const what of [words, only]) what.addEventListener("input", show);
  show();
}
theme();
document.documentElement.dataset.ready = "table";
