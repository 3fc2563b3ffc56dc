// Bodies, lines and points with values in three dimensions: small pages that are no result of a run.
import { Box3, BufferAttribute, BufferGeometry, DoubleSide, LineBasicMaterial, LineSegments, Mesh, MeshLambertMaterial, Points, PointsMaterial, Raycaster, Vector2 } from "three";
import { deviationScale } from "./colours.js";
import { formatted } from "./data.js";
import { stage } from "./stage.js";

export function sceneOf(root, data) {
  const set = stage(root, data.words);
  if (!set) return null;
  const { scene, camera, render, renderer } = set, box = new Box3(), list = document.querySelector("#layers"), said = document.querySelector("#said");
  const scale = data.reach ? deviationScale(data.reach) : null;
  const clouds = [];
  for (const layer of data.scene) {
    const points = data.arrays[layer.points], geometry = new BufferGeometry();
    for (let k = 0; k < points.length; k += 3) if (points[k] === points[k]) box.expandByPoint({ x: points[k], y: points[k + 1], z: points[k + 2] });
    geometry.setAttribute("position", new BufferAttribute(points, 3));
    let drawn;
    if (layer.kind === "body") {
      geometry.setIndex(new BufferAttribute(data.arrays[layer.triangles], 1));
      const clear = layer.opacity < 1;
      drawn = new Mesh(geometry, new MeshLambertMaterial({ color: layer.colour, transparent: clear, opacity: layer.opacity, side: DoubleSide, flatShading: true, depthWrite: !clear }));
    } else if (layer.kind === "points") {
      const tint = new Uint8Array(points.length);
      data.arrays[layer.values].forEach((v, k) => tint.set(scale.colour(scale.share(v) ?? 0.5), 3 * k));
      geometry.setAttribute("color", new BufferAttribute(tint, 3, true));
      drawn = new Points(geometry, new PointsMaterial({ size: layer.size, vertexColors: true, sizeAttenuation: false }));
      clouds.push(drawn);
    } else { // a line from place to place, new after a gap
      const index = [];
      for (let k = 1; k < points.length / 3; k++) if (points[3 * k] === points[3 * k] && points[3 * k - 3] === points[3 * k - 3]) index.push(k - 1, k);
      const ends = new Float32Array(3 * index.length);
      index.forEach((k, n) => ends.set(points.subarray(3 * k, 3 * k + 3), 3 * n));
      geometry.setAttribute("position", new BufferAttribute(ends, 3));
      drawn = new LineSegments(geometry, new LineBasicMaterial({ color: layer.colour }));
    }
    drawn.userData = layer;
    drawn.frustumCulled = false;
    scene.add(drawn);
    const label = document.createElement("label"), tick = document.createElement("input"), mark = document.createElement("i");
    tick.type = "checkbox";
    tick.checked = true;
    tick.addEventListener("change", () => { drawn.visible = tick.checked; render(); });
    mark.style.background = layer.colour ?? "";
    label.append(tick, mark, layer.name);
    list.append(label);
  }
  set.frame(box);
  if (scale) {
    document.querySelector("#ramp").style.background = `linear-gradient(90deg, ${[0, 0.25, 0.5, 0.75, 1].map((s) => `rgb(${scale.colour(s).map(Math.round).join(",")})`).join(", ")})`;
    document.querySelector("#ramp-low").textContent = `${formatted(scale.low, 3)} mm`;
    document.querySelector("#ramp-high").textContent = `${formatted(scale.high, 3)} mm`;
  }
  document.querySelector("#home").addEventListener("click", set.home);
  const ray = new Raycaster();
  renderer.domElement.addEventListener("pointermove", (event) => {
    if (!clouds.length || event.buttons) return;
    const frame = renderer.domElement.getBoundingClientRect();
    ray.setFromCamera(new Vector2((2 * (event.clientX - frame.left)) / frame.width - 1, 1 - (2 * (event.clientY - frame.top)) / frame.height), camera);
    ray.params.Points.threshold = (5 * (camera.right - camera.left)) / camera.zoom / frame.width;
    const hit = ray.intersectObjects(clouds.filter((cloud) => cloud.visible), false)[0];
    if (!hit) { said.textContent = ""; return; }
    const layer = hit.object.userData, at = hit.object.geometry.attributes.position.array.subarray(3 * hit.index, 3 * hit.index + 3);
    const block = data.arrays[layer.blocks][hit.index];
    said.textContent = `x ${formatted(at[0], 6)}, y ${formatted(at[1], 6)}, z ${formatted(at[2], 6)}: ${formatted(data.arrays[layer.values][hit.index], 4)} mm`
      + (block >= 0 ? `, block ${block}` : "");
  });
  return set;
}
