// A canvas with light, a camera without perspective and mouse controls; what it draws is put into `scene`.
import { AmbientLight, ColorManagement, DirectionalLight, LinearSRGBColorSpace, OrthographicCamera, Scene, Vector3, WebGLRenderer } from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";

ColorManagement.enabled = false; // colours of a legend, not of a photograph
export const UP = new Vector3(0, 0, 1);
const LEAN = new Vector3(-0.75, -1.3, 1.05).normalize();

// Without a graphics card smooth edges cost more than all the rest.
let soft = null;
export function isSoftware() {
  if (soft !== null) return soft;
  const gl = document.createElement("canvas").getContext("webgl2");
  const info = gl?.getExtension("WEBGL_debug_renderer_info");
  soft = !info || /swiftshader|llvmpipe|software/i.test(gl.getParameter(info.UNMASKED_RENDERER_WEBGL));
  gl?.getExtension("WEBGL_lose_context")?.loseContext();
  return soft;
}

export function stage(root, words) {
  let renderer;
  try {
    renderer = new WebGLRenderer({ antialias: !isSoftware(), alpha: true, preserveDrawingBuffer: true });
  } catch {
    return null;
  }
  renderer.outputColorSpace = LinearSRGBColorSpace;
  if (!isSoftware()) renderer.setPixelRatio(Math.min(2, devicePixelRatio));
  root.replaceChildren(renderer.domElement);
  renderer.domElement.setAttribute("role", "img");
  renderer.domElement.setAttribute("aria-label", words);
  const scene = new Scene();
  const camera = new OrthographicCamera(-1, 1, 1, -1, -1e6, 1e6);
  camera.up.copy(UP);
  const controls = new OrbitControls(camera, renderer.domElement);
  const lamp = new DirectionalLight(0xffffff, 2.1);
  scene.add(new AmbientLight(0xffffff, 1.35), lamp, camera);
  const size = new Vector3(1, 1, 1), centre = new Vector3(), lean = LEAN.clone();

  function fit() {
    const width = root.clientWidth, height = root.clientHeight || 1;
    renderer.setSize(width, height, false);
    const right = new Vector3().crossVectors(UP, lean).normalize(), up = new Vector3().crossVectors(lean, right);
    const spread = (v) => Math.abs(v.x) * size.x + Math.abs(v.y) * size.y + Math.abs(v.z) * size.z;
    const half = 0.56 * Math.max(spread(up), (spread(right) * height) / width);
    const side = (half * width) / height, reach = 40 * size.length();
    Object.assign(camera, { left: -side, right: side, top: half, bottom: -half, near: -reach, far: reach });
    camera.updateProjectionMatrix();
    render();
  }
  function home() {
    controls.target.copy(centre);
    camera.position.copy(centre).addScaledVector(lean, 2 * size.length());
    camera.zoom = 1;
    controls.update();
    fit();
  }
  // Look at a box; a flat one from above.
  function frame(box) {
    box.getSize(size);
    if (size.z < 1e-6 * size.length()) lean.set(0, -1e-3, 1).normalize();
    size.max(new Vector3(1e-3, 1e-3, 1e-3));
    box.getCenter(centre);
    home();
  }

  let waiting = false;
  function render() {
    if (waiting) return;
    waiting = true;
    requestAnimationFrame(draw);
  }
  function draw() {
    waiting = false;
    lamp.position.copy(camera.position).add(new Vector3(0.4, 0.2, 0.9).multiplyScalar(size.length()));
    lamp.target.position.copy(controls.target);
    lamp.target.updateMatrixWorld();
    renderer.render(scene, camera);
  }
  controls.addEventListener("change", render);
  new ResizeObserver(fit).observe(root);
  return { scene, camera, controls, renderer, render, home, frame };
}
