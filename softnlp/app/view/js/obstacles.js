// Obstacles: clear surfaces to scale with their names, that a pointer drags and the keys of the keyboard move.
import { THREE } from "nicegui-scene";
import { Label } from "./label.js";
import { unpack } from "./unpack.js";

const OFTEN = 180; // between two messages while one is dragged [ms]
const EDGE = 2.5; // how near to the edge of a plane it is taken [mm]

export class Obstacles {
  // tell: is called with the number of an obstacle, how far it went since the last call [mm], and whether that is all.
  constructor(labels, tell) {
    this.labels = labels;
    this.tell = tell;
    this.group = new THREE.Group();
    this.made = [];
    this.chosen = -1;
    this.drag = null;
  }

  set(message, theme) {
    this.clear();
    const { held } = this; // what is dragged stands where the pointer has it
    this.made = message.map(({ triangles, edges, name, at, flat }, k) => {
      const group = new THREE.Group();
      const face = new THREE.BufferGeometry();
      face.setAttribute("position", new THREE.BufferAttribute(unpack(triangles, Float32Array), 3));
      face.computeVertexNormals();
      const look = { transparent: true, side: THREE.DoubleSide, depthWrite: false };
      const mesh = new THREE.Mesh(face, new THREE.MeshLambertMaterial({ ...look, opacity: 0.3 }));
      mesh.renderOrder = 5;
      mesh.userData.number = k;
      const lines = new THREE.BufferGeometry();
      lines.setAttribute("position", new THREE.BufferAttribute(unpack(edges, Float32Array), 3));
      const edge = new THREE.LineSegments(lines, new THREE.LineBasicMaterial({ transparent: true, opacity: 0.8 }));
      edge.renderOrder = 5;
      edge.userData.number = k;
      const label = new Label({ size: 13, weight: 600, inFront: true, rank: 1 });
      label.sprite.position.set(...at);
      this.labels.add(label);
      group.add(mesh, edge, label.sprite);
      this.group.add(group);
      return { group, mesh, edge, label, name, flat };
    });
    if (this.drag !== null && held !== undefined) this.made[this.drag.number]?.group.position.copy(held);
    if (this.chosen >= this.made.length) this.chosen = -1;
    this.paint(theme);
  }

  paint(theme) {
    this.made.forEach(({ mesh, edge, label, name }, k) => {
      const colour = k === this.chosen ? theme.chosen : theme.obstacle;
      mesh.material.color.set(colour);
      mesh.material.opacity = k === this.chosen ? 0.45 : 0.3;
      edge.material.color.set(colour);
      label.write(name, theme.ink, theme.halo);
    });
  }

  // Take the obstacle under a pointer, a plane by its edge, since it is wide; true where there is one.
  take(caster, camera) {
    caster.params.Line.threshold = EDGE;
    const hit = caster.intersectObjects(this.made.map(({ mesh, edge, flat }) => (flat ? edge : mesh)), false)[0];
    if (hit === undefined) return false;
    const plane = new THREE.Plane();
    plane.setFromNormalAndCoplanarPoint(camera.getWorldDirection(new THREE.Vector3()), hit.point);
    const { number } = hit.object.userData;
    this.chosen = number;
    this.held = this.made[number].group.position.clone();
    this.drag = { number, plane, from: hit.point.clone(), told: new THREE.Vector3(), at: 0, moved: false };
    return true;
  }

  // Let what was taken follow the pointer, and tell now and then how far it went.
  pull(caster) {
    const { plane, from, number } = this.drag;
    const point = caster.ray.intersectPlane(plane, new THREE.Vector3());
    if (point === null) return;
    const way = point.sub(from);
    this.drag.way = way;
    this.drag.moved = true;
    // A message that came meanwhile has it where it was told to be.
    this.held = way.clone().sub(this.drag.told);
    this.made[number]?.group.position.copy(this.held);
    if (performance.now() - this.drag.at > OFTEN) this.say(false);
  }

  say(done) {
    const { number, way, told } = this.drag;
    const step = way.clone().sub(told);
    told.copy(way);
    this.drag.at = performance.now();
    this.tell({ number, by: step.toArray(), done });
  }

  // Let go; true where it was moved.
  drop() {
    const { drag } = this;
    if (drag === null) return false;
    if (drag.moved) this.say(true);
    this.drag = null;
    this.held = undefined;
    return drag.moved;
  }

  // Choose the next obstacle, or none after the last one.
  next() {
    this.chosen = this.chosen + 1 < this.made.length ? this.chosen + 1 : -1;
    return this.chosen < 0 ? "no obstacle" : this.made[this.chosen].name;
  }

  clear() {
    for (const { group, mesh, edge, label } of this.made) {
      this.labels.delete(label);
      label.dispose();
      for (const part of [mesh, edge]) {
        part.geometry.dispose();
        part.material.dispose();
      }
      group.removeFromParent();
    }
    this.made = [];
  }
}
