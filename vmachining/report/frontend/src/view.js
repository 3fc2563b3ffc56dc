// The workpiece in three dimensions: the finished surface coloured by load, the path, the tool, and the cut as it is played.
import {
  Box3, BufferAttribute, BufferGeometry, DoubleSide, Group, LatheGeometry, LineBasicMaterial, LineSegments, Mesh, MeshLambertMaterial,
  Quaternion, Raycaster, Vector2, Vector3,
} from "three";
import { coarse } from "./coarse.js";
import { MARK, PATHS, RAW } from "./colours.js";
import { rowOf } from "./data.js";
import { heightField } from "./field.js";
import { shapeOf } from "./heights.js";
import { machineOf } from "./machine.js";
import { isSoftware, stage, UP } from "./stage.js";
import { volumeField } from "./volume.js";

const DRAGGED = 24_000; // triangles that are drawn while the view turns
const LIGHT = 2.5; // cells of the played cut are that much wider where no graphics card draws them

export function view(root, data, bus, load) {
  const { arrays, rows } = data;
  const set = stage(root, "Workpiece and tool path in three dimensions; the program beside it is the same in words");
  if (!set) return null; // no WebGL: the picture in the page stays
  const { scene, camera, controls, renderer, render } = set;

  const bench = new Group(); // all that turns with the tables of the machine
  bench.matrixAutoUpdate = false;
  scene.add(bench);

  // -- the finished surface: a corner of its own for every face, so that faces have colours and edges stay sharp
  const faces = arrays.face_block.length;
  const lacquer = new MeshLambertMaterial({ vertexColors: true, side: DoubleSide });
  function skin(triangles, blocks) {
    const corners = new Float32Array(3 * triangles.length), paint = new Uint8Array(corners.length);
    triangles.forEach((v, k) => corners.set(arrays.vertices.subarray(3 * v, 3 * v + 3), 3 * k));
    const geometry = new BufferGeometry();
    geometry.setAttribute("position", new BufferAttribute(corners, 3));
    geometry.setAttribute("color", new BufferAttribute(paint, 3, true));
    geometry.computeVertexNormals();
    const mesh = new Mesh(geometry, lacquer);
    return { mesh, triangles, paint, made: Int32Array.from(blocks, (b) => (b < 0 ? -1 : rowOf(arrays.block, b))), stale: true };
  }
  const fine = skin(arrays.triangles, arrays.face_block), part = new Group(), made = fine.made;
  part.add(fine.mesh);
  bench.add(part);
  // what turns while the mouse drags, where the surface is too fine to be drawn twenty times a second without a graphics card
  let rough = null;
  if (faces > DRAGGED && isSoftware()) {
    rough = skin(...coarse(arrays.vertices, arrays.triangles, arrays.face_block, DRAGGED));
    rough.mesh.visible = false;
    part.add(rough.mesh);
  }
  // what is framed: the part, of a run in hand the stock, or of a program alone the path
  const box = new Box3().setFromArray(faces ? arrays.vertices : arrays.points);
  if (!faces && data.volume) {
    const { low, pitch, size } = data.volume;
    box.setFromArray([...low, ...low.map((v, c) => v + pitch * (size[c] - 1))]);
  } else if (!faces && data.grid) {
    const { low, pitch, columns, rows: lines, floor } = data.grid;
    box.setFromArray([...low, floor, low[0] + columns * pitch, low[1] + lines * pitch, arrays.heights.reduce((a, b) => Math.max(a, b))]);
  }

  // -- the path
  const { points, kind, segment_row: segmentRow, axes } = arrays;
  const count = kind.length;
  const path = new Group();
  for (const [code, name] of [[1, "feed"], [2, "rapid"], [3, "hit"]]) {
    const places = [], owners = [];
    for (let s = 0; s < count; s++) {
      if (kind[s] !== code) continue;
      places.push(...points.subarray(3 * s, 3 * s + 6));
      owners.push(segmentRow[s]);
    }
    if (!places.length) continue;
    const lines = new BufferGeometry();
    lines.setAttribute("position", new BufferAttribute(new Float32Array(places), 3));
    const drawn = new LineSegments(lines, new LineBasicMaterial({ color: PATHS[name], transparent: true, opacity: name === "feed" ? 0.75 : 0.9 }));
    drawn.userData = { owners, name };
    path.add(drawn);
  }
  bench.add(path);

  const chosen = new LineSegments(new BufferGeometry(), new LineBasicMaterial({ color: 0xe8590c, depthTest: false }));
  chosen.renderOrder = 5;
  bench.add(chosen);

  // -- first segment and end of every row, for the tool and the played cut
  const firstOf = new Int32Array(rows + 1).fill(count);
  for (let s = count - 1; s >= 0; s--) if (kind[s] !== 0) firstOf[segmentRow[s]] = s;
  for (let r = rows - 1; r >= 0; r--) if (firstOf[r] === count) firstOf[r] = firstOf[r + 1];

  // -- tools
  const tools = data.tools.map((tool) => {
    const group = new Group();
    const body = (profile, colour, opacity) => {
      const lathe = new LatheGeometry(profile.map(([r, z]) => new Vector2(Math.max(r, 1e-6), z)), 40);
      lathe.rotateX(Math.PI / 2);
      group.add(new Mesh(lathe, new MeshLambertMaterial({ color: colour, transparent: opacity < 1, opacity, side: DoubleSide, depthWrite: opacity === 1 })));
    };
    body(tool.meridian, 0xd4a017, 0.6);
    if (tool.shank) body(tool.shank, 0x8a97a6, 0.5);
    if (tool.holder) body(tool.holder, 0x5c6875, 0.5);
    group.visible = false;
    group.userData.top = Math.max(...[...tool.meridian, ...(tool.holder ?? tool.shank ?? [])].map(([, z]) => z));
    bench.add(group);
    return group;
  });
  const shapes = data.tools.map((tool) => shapeOf(tool.meridian));

  // -- the workpiece as cut so far; without a graphics card a light one plays and turns, and the full one stands still
  const used = { points, axes, kind, row: segmentRow, tool: arrays.segment_tool, count };
  const tint = (row) => (row < 0 ? RAW : row === bus.row ? MARK : hues[row]);
  const fieldOf = (wide) => {
    const made = data.volume ? volumeField(data, used, wide, tint) : heightField(data, used, shapes, wide, tint);
    made.mesh.visible = false;
    made.mesh.frustumCulled = false;
    bench.add(made.mesh);
    return made;
  };
  const fields = data.grid || data.volume ? (isSoftware() ? [fieldOf(1), fieldOf(LIGHT)] : [fieldOf(1)]) : [];
  let field = fields[0] ?? null, moving = false;
  const machine = data.machine ? machineOf(data, box, scene, bench) : null;

  let byVertex = null;
  const hues = Array(rows);
  function recolour() {
    const { values, scale, vertices } = load();
    byVertex = vertices ? Array.from(vertices, (v) => scale.colour(scale.share(v) ?? 0.5)) : null;
    for (let r = 0; r < rows; r++) {
      const share = scale.share(values[r]);
      hues[r] = (share === null ? [120, 130, 142] : scale.colour(share)).map(Math.round);
    }
    paint();
    if (field?.mesh.visible) field.shape(true);
    render();
  }

  function paint() {
    for (const one of [fine, rough]) if (one) one.stale = true;
    coat(fine.mesh.visible ? fine : rough);
  }

  function coat(one) {
    if (!one?.stale) return;
    one.stale = false;
    const { made, paint, triangles } = one;
    for (let f = 0; f < made.length; f++) {
      const row = made[f];
      for (let c = 0; c < 3; c++) {
        const k = 9 * f + 3 * c;
        const hue = byVertex && row !== bus.row ? byVertex[triangles[3 * f + c]] : tint(row);
        paint[k] = hue[0]; paint[k + 1] = hue[1]; paint[k + 2] = hue[2];
      }
    }
    one.mesh.geometry.attributes.color.needsUpdate = true;
  }

  // Segment and share of it for a place in the table: `at` counts rows, its fraction goes by the length of the row's segments.
  function segmentAt(at) {
    const row = Math.min(rows - 1, Math.floor(at));
    if (at >= rows) return [count, 0];
    const from = firstOf[row], to = firstOf[row + 1];
    let total = 0;
    const lengths = [];
    for (let s = from; s < to; s++) {
      const length = kind[s] === 0 ? 0 : Math.hypot(points[3 * s + 3] - points[3 * s], points[3 * s + 4] - points[3 * s + 1], points[3 * s + 5] - points[3 * s + 2]);
      lengths.push(length);
      total += length;
    }
    let left = (at - row) * total;
    for (let k = 0; k < lengths.length; k++) {
      if (left < lengths[k]) return [from + k, left / lengths[k]];
      left -= lengths[k];
    }
    return [to, 0];
  }

  function stand() {
    const playing = bus.at < bus.count;
    const [segment, share] = playing ? segmentAt(bus.at) : bus.row >= 0 ? segmentAt(bus.row + 0.999) : [count, 0];
    tools.forEach((tool) => { tool.visible = false; });
    let top = null; // of the tool that stands in the part
    if (segment < count && (playing || bus.row >= 0)) {
      const tool = tools[arrays.segment_tool[segment]];
      if (tool) {
        const a = 3 * segment;
        tool.visible = root.dataset.tool !== "off";
        tool.position.set(
          points[a] + share * (points[a + 3] - points[a]), points[a + 1] + share * (points[a + 4] - points[a + 1]),
          points[a + 2] + share * (points[a + 5] - points[a + 2]));
        const axis = axes ? new Vector3(...axes.subarray(a, a + 3)).lerp(new Vector3(...axes.subarray(a + 3, a + 6)), share).normalize() : UP;
        tool.quaternion.copy(new Quaternion().setFromUnitVectors(UP, axis));
        top = tool.position.clone().addScaledVector(axis, tool.userData.top);
      }
    }
    machine?.(top && playing && root.dataset.machine !== "off" ? segment : -1, share, top);
    if (field) {
      field = fields[moving && fields.length > 1 ? 1 : 0];
      for (const one of fields) one.mesh.visible = playing && one === field;
      part.visible = !playing;
      if (playing) { field.to(segment, share); field.shape(); }
    } else {
      paint();
    }
  }

  function trace() {
    const places = [];
    if (bus.row >= 0) for (let s = firstOf[bus.row]; s < firstOf[bus.row + 1]; s++) if (kind[s] !== 0) places.push(...points.subarray(3 * s, 3 * s + 6));
    chosen.geometry.dispose();
    chosen.geometry = new BufferGeometry();
    chosen.geometry.setAttribute("position", new BufferAttribute(new Float32Array(places), 3));
  }

  // -- a click marks the block whose face or path is hit
  const ray = new Raycaster();
  let pressed = null;
  renderer.domElement.addEventListener("pointerdown", (event) => { pressed = [event.clientX, event.clientY]; });
  renderer.domElement.addEventListener("pointerup", (event) => {
    if (!pressed || Math.hypot(event.clientX - pressed[0], event.clientY - pressed[1]) > 4) return;
    const frame = renderer.domElement.getBoundingClientRect();
    ray.setFromCamera(new Vector2((2 * (event.clientX - frame.left)) / frame.width - 1, 1 - (2 * (event.clientY - frame.top)) / frame.height), camera);
    ray.params.Line.threshold = (4 * (camera.right - camera.left)) / camera.zoom / frame.width;
    let row = -1;
    const hits = ray.intersectObject(field?.mesh.visible ? field.mesh : fine.mesh, false);
    if (hits.length) {
      row = field?.mesh.visible ? field.rowAt(hits[0].face) : made[hits[0].faceIndex];
    }
    if (row < 0 && path.visible) {
      const line = ray.intersectObjects(path.children, false)[0];
      if (line) row = line.object.userData.owners[Math.floor(line.index / 2)];
    }
    bus.select(row, "view");
  });
  const turning = (on) => {
    turns = on;
    settle();
    if (!rough) return;
    rough.mesh.visible = on;
    fine.mesh.visible = !on;
    coat(on ? rough : fine);
    render();
  };
  // something moves: the light field, until it rests
  let plays = false, turns = false;
  function settle() {
    if (moving === (plays || turns)) return;
    moving = plays || turns;
    stand();
    if (field?.mesh.visible) field.shape(true);
    render();
  }
  controls.addEventListener("start", () => turning(true));
  controls.addEventListener("end", () => turning(false));

  bus.listen((what, source) => {
    if (what === "row") { trace(); if (part.visible) paint(); if (field?.mesh.visible) field.shape(true); }
    if (what === "at" || what === "rest") { plays = what === "at" && (source === "timer" || source === "slider"); settle(); }
    stand();
    render();
  });
  recolour();
  set.frame(box);
  return {
    recolour, home: set.home, render,
    show(what, on) {
      if (what === "path") path.visible = on;
      else { root.dataset[what] = on ? "on" : "off"; stand(); }
      render();
    },
  };
}
