// A surface with fewer triangles: the vertices of each cell of a grid become one, as in Rossignac and Borrel (1993). For the eye only.

export function coarse(vertices, triangles, blocks, most) {
  const low = [0, 1, 2].map((k) => { let v = Infinity; for (let i = k; i < vertices.length; i += 3) v = Math.min(v, vertices[i]); return v; });
  let size = 0;
  for (let i = 0; i < vertices.length; i++) size = Math.max(size, vertices[i] - low[i % 3]);
  for (let cell = size / 256; ; cell *= 1.3) {
    const first = new Map(), of = new Uint32Array(vertices.length / 3);
    for (let v = 0; v < of.length; v++) {
      const [i, j, k] = [0, 1, 2].map((a) => Math.floor((vertices[3 * v + a] - low[a]) / cell));
      const key = (i * 1024 + j) * 1024 + k;
      if (!first.has(key)) first.set(key, v);
      of[v] = first.get(key);
    }
    const kept = [], owners = [];
    for (let f = 0; f < blocks.length; f++) {
      const [a, b, c] = [of[triangles[3 * f]], of[triangles[3 * f + 1]], of[triangles[3 * f + 2]]];
      if (a !== b && b !== c && c !== a) { kept.push(a, b, c); owners.push(blocks[f]); }
    }
    if (owners.length <= most || cell > size / 12) return [Uint32Array.from(kept), Int32Array.from(owners)];
  }
}
