// The workpiece while it is cut, as heights over a grid: a picture, made from the path and the cutters in the browser.
// Brackets and volumes of the page come from the engines and never from here.

import { Played } from "./played.js";

export class Heights extends Played {
  constructor(grid, path, tools) {
    super(path, ["z", "owner"], 24);
    Object.assign(this, grid); // low, pitch, columns, rows, start (heights), floor
    this.tools = tools;
    this.z = Float32Array.from(this.start);
    this.owner = new Int32Array(this.z.length).fill(-1);
    this.keep();
  }

  cut(segment, share) {
    const { points, kind, row, tool } = this.path;
    if (kind[segment] !== 1) return; // rapids take nothing in the picture; the report names those that would
    const shape = this.tools[tool[segment]];
    if (!shape) return;
    const a = 3 * segment, b = a + 3;
    const x0 = points[a], y0 = points[a + 1], z0 = points[a + 2];
    const dx = (points[b] - x0) * share, dy = (points[b + 1] - y0) * share, dz = (points[b + 2] - z0) * share;
    const radius = shape.radius, { low, pitch, columns, rows, z, owner, floor } = this;
    const i0 = Math.max(0, Math.floor((Math.min(x0, x0 + dx) - radius - low[0]) / pitch));
    const i1 = Math.min(columns - 1, Math.ceil((Math.max(x0, x0 + dx) + radius - low[0]) / pitch));
    const j0 = Math.max(0, Math.floor((Math.min(y0, y0 + dy) - radius - low[1]) / pitch));
    const j1 = Math.min(rows - 1, Math.ceil((Math.max(y0, y0 + dy) + radius - low[1]) / pitch));
    const flat = dx * dx + dy * dy, steps = dz === 0 ? 0 : 6, lowest = Math.min(z0, z0 + dz) + shape.heights[0];
    for (let j = j0; j <= j1; j++) {
      const y = low[1] + (j + 0.5) * pitch - y0;
      for (let i = i0; i <= i1; i++) {
        const cell = j * columns + i;
        if (z[cell] <= lowest) continue;
        const x = low[0] + (i + 0.5) * pitch - x0;
        const along = flat > 0 ? (x * dx + y * dy) / flat : 0;
        const near = Math.max(0, Math.min(1, along));
        let away = Math.hypot(x - near * dx, y - near * dy);
        if (away > radius) continue;
        let height = z0 + near * dz + shape.over(away);
        if (steps) {
          const half = flat > 0 ? Math.sqrt(Math.max(0, radius * radius - away * away) / flat) : 1;
          const from = Math.max(0, near - half), to = Math.min(1, near + half);
          for (let k = 0; k <= steps; k++) {
            const t = from + ((to - from) * k) / steps;
            away = Math.hypot(x - t * dx, y - t * dy);
            if (away <= radius) height = Math.min(height, z0 + t * dz + shape.over(away));
          }
        }
        if (height < z[cell]) { z[cell] = Math.max(height, floor); owner[cell] = row[segment]; this.changed.push(cell); }
      }
    }
  }
}

// Lowest height of a cutter over its radius, in a table of 257 values.
export function shapeOf(meridian) {
  const radius = Math.max(...meridian.map((p) => p[0]));
  const heights = new Float32Array(257).fill(Infinity);
  for (let k = 0; k <= 256; k++) {
    const r = (radius * k) / 256;
    for (let i = 1; i < meridian.length; i++) {
      const [[r0, z0], [r1, z1]] = [meridian[i - 1], meridian[i]];
      if (r < Math.min(r0, r1) - 1e-9 || r > Math.max(r0, r1) + 1e-9) continue;
      const z = r1 === r0 ? Math.min(z0, z1) : z0 + ((z1 - z0) * (r - r0)) / (r1 - r0);
      heights[k] = Math.min(heights[k], z);
    }
    if (!Number.isFinite(heights[k])) heights[k] = k ? heights[k - 1] : meridian[0][1];
  }
  return { radius, heights, over: (r) => heights[Math.min(256, Math.round((256 * r) / radius))] };
}

// The same stock over cells `wide` times as wide, each as high as the highest of those it takes the middle of.
export function coarser(grid, wide) {
  if (wide === 1) return grid;
  const columns = Math.ceil(grid.columns / wide), rows = Math.ceil(grid.rows / wide), start = new Float32Array(columns * rows).fill(grid.floor);
  for (let c = 0; c < grid.start.length; c++) {
    const k = Math.floor(Math.floor(c / grid.columns) / wide) * columns + Math.floor((c % grid.columns) / wide);
    start[k] = Math.max(start[k], grid.start[c]);
  }
  return { ...grid, pitch: grid.pitch * wide, columns, rows, start };
}
