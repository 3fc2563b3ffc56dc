// The rotary axes of the machine while the cut is played: tables turn with the workpiece, the head with the tool. The slides follow
// without being drawn. Axes are given as they lie in the workpiece at home, `turns` in degrees for every point of the path.
import { CylinderGeometry, Group, Matrix4, Mesh, MeshLambertMaterial, Vector3 } from "three";

const SIDE = new Vector3(0, 1, 0); // along which three.js builds cylinders

export function machineOf(data, box, scene, bench) {
  const axes = data.machine.map((axis) => ({ ...axis, direction: new Vector3(...axis.direction), point: new Vector3(...axis.point) }));
  const { turns } = data.arrays, centre = box.getCenter(new Vector3()), size = box.getSize(new Vector3()).length() / 2;
  const root = new Group();
  const steel = new MeshLambertMaterial({ color: 0x7d8b99, flatShading: true });
  const drum = (radius, length, corners, direction, place) => {
    const body = new Mesh(new CylinderGeometry(radius, radius, length, corners), steel);
    body.quaternion.setFromUnitVectors(SIDE, direction);
    body.position.copy(place);
    return body;
  };
  // a drum whose corners let its turning be seen: beneath the part, at both ends of a cradle, above the tool
  const made = axes.map((axis, k) => {
    const body = new Group(), foot = axis.point.clone().addScaledVector(axis.direction, centre.clone().sub(axis.point).dot(axis.direction));
    body.matrixAutoUpdate = false;
    const low = Math.abs(axis.direction.x) * (box.max.x - box.min.x) + Math.abs(axis.direction.y) * (box.max.y - box.min.y) + Math.abs(axis.direction.z) * (box.max.z - box.min.z);
    const up = axis.direction.z < 0 ? -1 : 1;
    if (axis.table && k === 0) body.add(drum(size, 0.12 * size, 10, axis.direction, foot.addScaledVector(axis.direction, -up * (low / 2 + 0.06 * size))));
    else if (axis.table) for (const end of [-1.35, 1.35]) body.add(drum(0.22 * size, 0.3 * size, 6, axis.direction, foot.clone().addScaledVector(axis.direction, end * size)));
    else body.add(drum(0.2 * size, 0.5 * size, 6, axis.direction, new Vector3()));
    root.add(body);
    return body;
  });
  scene.add(root);

  const turn = (axis, degrees) => new Matrix4().makeTranslation(axis.point)
    .multiply(new Matrix4().makeRotationAxis(axis.direction, (axis.sign * degrees * Math.PI) / 180)).multiply(new Matrix4().makeTranslation(axis.point.clone().negate()));

  // At a place of the path, where the tool reaches to `top` in the workpiece; without a place everything stands at home and no machine is drawn.
  return (segment, share, top) => {
    root.visible = segment >= 0;
    bench.matrix.identity();
    if (segment >= 0) {
      const n = axes.length, at = axes.map((_, k) => turns[n * segment + k] + share * (turns[n * segment + n + k] - turns[n * segment + k]));
      const tables = axes.filter((axis) => axis.table).length;
      let whole = new Matrix4();
      for (let k = tables - 1; k >= 0; k--) { // from the bed to the part
        whole = whole.multiply(turn(axes[k], at[k]).invert());
        made[k].matrix.copy(whole);
      }
      bench.matrix.copy(whole);
      const head = top.clone().applyMatrix4(whole);
      let held = new Matrix4();
      for (let k = tables; k < n; k++) { // from the bed to the tool
        held = held.multiply(turn(axes[k], at[k]));
        made[k].matrix.copy(new Matrix4().makeTranslation(head.x, head.y, head.z).multiply(new Matrix4().extractRotation(held)));
      }
    }
    bench.matrixWorldNeedsUpdate = true;
  };
}
