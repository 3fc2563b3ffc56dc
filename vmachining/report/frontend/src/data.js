// What the page was given: a gzipped container, [uint32 length of the header][JSON header][arrays], see payload.py.

const KINDS = { f4: Float32Array, i4: Int32Array, u4: Uint32Array, u1: Uint8Array, i1: Int8Array, u2: Uint16Array };

export async function unpack(text) {
  const packed = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
  const buffer = await new Response(stream).arrayBuffer();
  const length = new DataView(buffer).getUint32(0, true);
  const head = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
  const arrays = {};
  for (const [name, { kind, offset, length: n }] of Object.entries(head.arrays)) {
    arrays[name] = new KINDS[kind](buffer, 4 + length + offset, n);
  }
  return { ...head, arrays };
}

// Row of the table that stands for a block: itself, or where rows were thinned the nearest one before it.
export function rowOf(blocks, block) {
  let low = 0, high = blocks.length - 1;
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (blocks[middle] <= block) low = middle; else high = middle - 1;
  }
  return low;
}

export function formatted(value, digits = 5) {
  if (value === null || value === undefined || Number.isNaN(value)) return "–";
  if (value === 0) return "0";
  const size = Math.abs(value);
  if (size >= 1e-4 && size < 1e9) {
    const decimals = Math.max(0, digits - 1 - Math.floor(Math.log10(size)));
    return value.toLocaleString("en-US", { maximumFractionDigits: Math.min(decimals, 10) }).replaceAll(",", "\u202f");
  }
  return value.toExponential(2);
}
