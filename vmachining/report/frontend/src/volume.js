// The workpiece while it is cut where the tool leans or undercuts: signed distances at the corners of cubic cells, from which every
// pose of the cutter takes its own, drawn as surface nets (Gibson 1998). A picture; volumes and brackets come from the engines.
import { BufferAttribute, BufferGeometry, DoubleSide, DynamicDrawUsage, Mesh, MeshLambertMaterial } from "three";
import { Played } from "./played.js";

const FULL = 127; // value of a distance of BAND cells and more
const BAND = 2, TABLE = 3; // table cells to a cell of the picture
const MOST_POSES = 80_000;

export class Volume extends Played {
  // grid : low (3), pitch, size (3). start : distances, < 0 inside, FULL to BAND cells. path as of Heights, with axes or null for upright.
  constructor(grid, start, path, meridians) {
    super(path, ["field", "owner"], 16);
    Object.assign(this, grid);
    this.field = Int8Array.from(start);
    this.owner = new Int32Array(start.length).fill(-1);
    this.tools = meridians.map((meridian) => distancesOf(meridian, this.pitch));
    let length = 0;
    const { points, kind } = path;
    for (let s = 0; s < path.count; s++) if (kind[s] === 1) length += Math.hypot(...[0, 1, 2].map((c) => points[3 * s + 3 + c] - points[3 * s + c]));
    this.step = Math.max(this.pitch / 2, length / MOST_POSES);
    this.keep();
  }

  cut(segment, share) {
    const { points, axes, kind, row, tool } = this.path;
    const shape = this.tools[tool[segment]];
    if (kind[segment] !== 1 || !shape) return; // rapids take nothing in the picture; the report names those that would
    this.all = true;
    const a = 3 * segment, way = [0, 1, 2].map((c) => points[a + 3 + c] - points[a + c]);
    const lean = axes ? [0, 1, 2].map((c) => axes[a + 3 + c] - axes[a + c]) : [0, 0, 0];
    const reach = share * Math.max(Math.hypot(...way), Math.hypot(...way.map((v, c) => v + shape.high * lean[c])));
    const count = Math.max(1, Math.ceil(reach / this.step));
    for (let k = segment > 0 && kind[segment - 1] === 1 ? 1 : 0; k <= count; k++) {
      const t = (share * k) / count;
      const axis = axes ? [0, 1, 2].map((c) => axes[a + c] + t * lean[c]) : [0, 0, 1], size = Math.hypot(...axis);
      this.carve(shape, row[segment], points[a] + t * way[0], points[a + 1] + t * way[1], points[a + 2] + t * way[2], axis.map((v) => v / size));
    }
  }

  // Take one pose of a cutter out: tip (x, y, z), unit axis.
  carve(shape, row, x, y, z, [ax, ay, az]) {
    const { low, pitch, size: [nx, ny, nz], field, owner } = this, { radius, bottom, high, table, wide, scale } = shape;
    const bounds = [ax, ay, az].map((v, c) => {
      const aside = radius * Math.sqrt(Math.max(0, 1 - v * v)), from = [x, y, z][c] - low[c], ends = [bottom * v, high * v];
      return [Math.ceil((from + Math.min(...ends) - aside) / pitch), Math.floor((from + Math.max(...ends) + aside) / pitch)];
    });
    const [j0, k0] = [Math.max(0, bounds[1][0]), Math.max(0, bounds[2][0])], [j1, k1] = [Math.min(ny - 1, bounds[1][1]), Math.min(nz - 1, bounds[2][1])];
    const flat = 1 - ax * ax;
    for (let k = k0; k <= k1; k++) {
      const dz = low[2] + k * pitch - z;
      for (let j = j0; j <= j1; j++) {
        const dy = low[1] + j * pitch - y, dx = low[0] - x;
        // where this line of corners is within the radius about the axis
        const along = dx * ax + dy * ay + dz * az, b = dx - along * ax, c = dx * dx + dy * dy + dz * dz - along * along - radius * radius;
        let from = bounds[0][0], to = bounds[0][1];
        if (flat > 1e-9) {
          const root = b * b - flat * c;
          if (root < 0) continue;
          from = Math.max(from, Math.ceil((-b - Math.sqrt(root)) / flat / pitch));
          to = Math.min(to, Math.floor((-b + Math.sqrt(root)) / flat / pitch));
        } else if (c > 0) continue;
        for (let i = Math.max(0, from), v = (k * ny + j) * nx + i; i <= Math.min(nx - 1, to); i++, v++) {
          if (field[v] === FULL) continue;
          const px = dx + i * pitch, up = px * ax + dy * ay + dz * az;
          if (up < bottom || up > high) continue;
          const away = Math.sqrt(Math.max(0, px * px + dy * dy + dz * dz - up * up));
          const value = table[Math.round((up - bottom) * scale) * wide + Math.round(away * scale)];
          if (value > field[v]) { field[v] = value; owner[v] = row; }
        }
      }
    }
  }
}

// What a cutter leaves around itself, FULL inside to -FULL far outside, over height and distance from its axis.
function distancesOf(meridian, pitch) {
  const edge = BAND * pitch, scale = TABLE / pitch;
  const radius = Math.max(...meridian.map((p) => p[0])) + edge, bottom = Math.min(...meridian.map((p) => p[1])) - edge, high = Math.max(...meridian.map((p) => p[1])) + edge;
  const wide = Math.ceil(radius * scale) + 2, tall = Math.ceil((high - bottom) * scale) + 2, table = new Int8Array(wide * tall);
  for (let k = 0; k < tall; k++) {
    for (let i = 0; i < wide; i++) {
      const r = i / scale, z = bottom + k / scale;
      let near = Infinity, inside = false;
      for (let n = 1; n < meridian.length; n++) {
        const [[r0, z0], [r1, z1]] = [meridian[n - 1], meridian[n]], dr = r1 - r0, dz = z1 - z0, square = dr * dr + dz * dz;
        const t = square > 0 ? Math.max(0, Math.min(1, ((r - r0) * dr + (z - z0) * dz) / square)) : 0;
        near = Math.min(near, Math.hypot(r - r0 - t * dr, z - z0 - t * dz));
        if ((z0 > z) !== (z1 > z) && r < r0 + ((z - z0) * dr) / dz) inside = !inside;
      }
      table[k * wide + i] = Math.round(FULL * Math.max(-1, Math.min(1, (inside ? near : -near) / edge)));
    }
  }
  return { radius, bottom, high, table, wide, scale };
}

// Every second corner in each direction.
function halved({ low, pitch, size: [nx, ny, nz] }, start) {
  const size = [nx, ny, nz].map((n) => Math.ceil(n / 2)), values = new Int8Array(size[0] * size[1] * size[2]);
  let v = 0;
  for (let k = 0; k < nz; k += 2) for (let j = 0; j < ny; j += 2) for (let i = 0; i < nx; i += 2) {
    const value = start[(k * ny + j) * nx + i];
    values[v++] = Math.abs(value) === FULL ? value : value / 2;
  }
  return [{ low, pitch: 2 * pitch, size }, values];
}

export function volumeField(data, used, wide, tint) {
  const whole = [data.volume, data.arrays.volume], cells = new Volume(...(wide > 1 ? halved(...whole) : whole), used, data.tools.map((tool) => tool.meridian));
  const geometry = new BufferGeometry(), mesh = new Mesh(geometry, new MeshLambertMaterial({ vertexColors: true, side: DoubleSide }));
  const { low, pitch, size: [nx, ny, nz], field } = cells, numbers = new Int32Array(field.length);
  const strides = [1, nx, nx * ny], corner = Array.from({ length: 8 }, (_, m) => (m & 1) + ((m >> 1) & 1) * nx + (m >> 2) * nx * ny);
  const edges = [];
  for (let m = 0; m < 8; m++) for (let axis = 0; axis < 3; axis++) if (!(m & (1 << axis))) edges.push([m, m | (1 << axis), axis]);
  let room = 0, at, normal, hue, index, owners;
  function grow(count) {
    room = count;
    [at, normal, hue, index] = [new Float32Array(3 * room), new Float32Array(3 * room), new Uint8Array(3 * room), new Uint32Array(9 * room)];
    owners = new Int32Array(room);
    for (const [name, array, whole] of [["position", at, false], ["normal", normal, false], ["color", hue, true]]) geometry.setAttribute(name, new BufferAttribute(array, 3, whole).setUsage(DynamicDrawUsage));
    geometry.setIndex(new BufferAttribute(index, 1).setUsage(DynamicDrawUsage));
  }
  grow(8 * Math.ceil(field.length ** (2 / 3)));

  function shape(all = false) {
    if (!all && !cells.all) return;
    cells.all = false;
    let count = 0, used = 0;
    const x = [0, 0, 0], value = new Float32Array(8), place = new Float64Array(3), lean = new Float64Array(3);
    for (x[2] = 0; x[2] < nz - 1; x[2]++) for (x[1] = 0; x[1] < ny - 1; x[1]++) {
      x[0] = 0;
      for (let v = (x[2] * ny + x[1]) * nx; x[0] < nx - 1; x[0]++, v++) {
        let mask = 0;
        for (let m = 0; m < 8; m++) if (field[v + corner[m]] < 0) mask |= 1 << m;
        if (mask === 0 || mask === 255) continue;
        if (count === room) { // larger buffers, from the start
          geometry.dispose();
          grow(2 * room);
          return shape(true);
        }
        let owner = -1, least = FULL + 1;
        for (let m = 0; m < 8; m++) {
          value[m] = field[v + corner[m]];
          if (value[m] >= 0 && value[m] < least && cells.owner[v + corner[m]] >= 0) { least = value[m]; owner = cells.owner[v + corner[m]]; }
        }
        place.fill(0);
        lean.fill(0);
        let crossings = 0;
        for (let e = 0; e < 12; e++) {
          const [m, n, axis] = edges[e];
          lean[axis] += value[n] - value[m];
          if (value[m] < 0 === value[n] < 0) continue;
          crossings += 1;
          for (let c = 0; c < 3; c++) place[c] += c === axis ? value[m] / (value[m] - value[n]) : (m >> c) & 1;
        }
        const long = Math.hypot(lean[0], lean[1], lean[2]) || 1, colour = tint(owner);
        for (let c = 0; c < 3; c++) {
          at[3 * count + c] = low[c] + pitch * (x[c] + place[c] / crossings);
          normal[3 * count + c] = lean[c] / long;
          hue[3 * count + c] = colour[c];
        }
        owners[count] = owner;
        numbers[v] = count++;
        for (let axis = 0; axis < 3; axis++) {
          const first = (axis + 1) % 3, second = (axis + 2) % 3;
          if ((mask & 1) === ((mask >> (1 << axis)) & 1) || x[first] === 0 || x[second] === 0) continue;
          const quad = [numbers[v], numbers[v - strides[first]], numbers[v - strides[first] - strides[second]], numbers[v - strides[second]]];
          if (!(mask & 1)) quad.reverse();
          for (const k of [0, 1, 2, 0, 2, 3]) index[used++] = quad[k];
        }
      }
    }
    geometry.setDrawRange(0, used);
    geometry.boundingSphere = null; // of another shape now, for the click that asks which face is hit
    for (const name of ["position", "normal", "color"]) geometry.attributes[name].needsUpdate = true;
    geometry.index.needsUpdate = true;
  }
  return { mesh, shape, to: (segment, share) => cells.to(segment, share), rowAt: (face) => owners[face.a] };
}
