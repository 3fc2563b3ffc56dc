// The workpiece as cut so far, drawn over the cells of `Heights`: four corners a cell, so that every cell is a level tile.
import { BufferAttribute, BufferGeometry, DoubleSide, Mesh, MeshLambertMaterial } from "three";
import { RAW } from "./colours.js";
import { coarser, Heights } from "./heights.js";

// `wide` : cells are that many times as wide. `tint(row)` : red, green, blue of what a row has cut.
export function heightField(data, used, shapes, wide, tint) {
  const grid = coarser({ ...data.grid, start: data.arrays.heights }, wide);
  const heights = new Heights(grid, used, shapes);
  const { columns, rows: lines } = grid;
  const geometry = new BufferGeometry();
  // walls close the steps to neighbours, a skirt the border
  const cells = columns * lines, there = (c) => grid.start[c] > grid.floor, index = [];
  const skirt = []; // [cell, first corner, second corner] of every wall down to the floor
  for (let j = 0; j < lines; j++) {
    for (let i = 0; i < columns; i++) {
      const c = j * columns + i, v = 4 * c;
      if (!there(c)) continue;
      index.push(v, v + 1, v + 2, v, v + 2, v + 3);
      if (i + 1 < columns && there(c + 1)) index.push(v + 1, v + 4, v + 7, v + 1, v + 7, v + 2);
      else skirt.push([c, 1, 2]);
      if (j + 1 < lines && there(c + columns)) {
        const w = 4 * (c + columns);
        index.push(v + 3, v + 2, w + 1, v + 3, w + 1, w);
      } else skirt.push([c, 2, 3]);
      if (i === 0 || !there(c - 1)) skirt.push([c, 3, 0]);
      if (j === 0 || !there(c - columns)) skirt.push([c, 0, 1]);
    }
  }
  const at = new Float32Array(12 * cells + 6 * skirt.length), hue = new Uint8Array(at.length);
  for (let j = 0; j < lines; j++) {
    for (let i = 0; i < columns; i++) {
      const k = 12 * (j * columns + i), x = grid.low[0] + i * grid.pitch, y = grid.low[1] + j * grid.pitch;
      at.set([x, y, 0, x + grid.pitch, y, 0, x + grid.pitch, y + grid.pitch, 0, x, y + grid.pitch, 0], k);
    }
  }
  skirt.forEach(([c, a, b], n) => {
    const k = 12 * cells + 6 * n, v = 4 * cells + 2 * n;
    for (const [o, corner] of [[0, a], [3, b]]) {
      at.set([at[12 * c + 3 * corner], at[12 * c + 3 * corner + 1], grid.floor], k + o);
      hue.set(RAW, k + o);
    }
    index.push(4 * c + a, v, v + 1, 4 * c + a, v + 1, 4 * c + b);
  });
  geometry.setAttribute("position", new BufferAttribute(at, 3));
  geometry.setAttribute("color", new BufferAttribute(hue, 3, true));
  geometry.setIndex(index);
  const mesh = new Mesh(geometry, new MeshLambertMaterial({ vertexColors: true, side: DoubleSide, flatShading: true }));

  // Bring the picture of the heights up to date; all of it, or the cells that were cut.
  function shape(all = false) {
    const { z, owner } = heights;
    const one = (c) => {
      const [red, green, blue] = tint(owner[c]), h = z[c];
      for (let k = 12 * c; k < 12 * c + 12; k += 3) { at[k + 2] = h; hue[k] = red; hue[k + 1] = green; hue[k + 2] = blue; }
    };
    if (all || heights.all) for (let c = 0; c < z.length; c++) one(c);
    else for (const c of heights.changed) one(c);
    heights.all = false;
    heights.changed.length = 0;
    geometry.attributes.position.needsUpdate = true;
    geometry.attributes.color.needsUpdate = true;
  }
  return { mesh, shape, to: (segment, share) => heights.to(segment, share), rowAt: (face) => heights.owner[Math.floor(face.a / 4)] ?? -1 };
}
