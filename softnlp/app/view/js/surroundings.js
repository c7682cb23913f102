// What stands still: ground grid with its scale in millimetres, base plate, base frame, and the number of each set.
import { THREE } from "nicegui-scene";
import { LAST, Label } from "./label.js";

const TICKS = 3.2; // numbers along the natural length, at most
const PLATE = 0.1; // thickness of the base plate, of D_r; it stands on the ground, so that the base is at z = 0

// The nearest of 1, 2, 5 times a power of ten.
export function roundStep(length) {
  const decade = 10 ** Math.floor(Math.log10(length));
  return [1, 2, 5, 10].map((n) => n * decade).find((step) => step >= length * 0.999);
}

export class Surroundings {
  constructor(labels) {
    this.labels = labels;
    this.group = new THREE.Group();
    this.key = null;
  }

  // length, width: L_0 and D_r [mm]. Nothing is made again while they stay.
  build(length, width, sets, theme) {
    const key = JSON.stringify([length, width, sets, theme.background]);
    if (key === this.key) return;
    this.key = key;
    this.clear();
    this.theme = theme;
    const step = roundStep(length / TICKS);
    const half = step * Math.ceil((0.8 * length) / step);
    this.floor = -PLATE * width;
    this.grid(step, half);
    this.ticks(step, half, length);
    this.plate(width);
    this.frame(0.22 * length, width);
    sets.forEach(({ colour, angle }, k) => {
      const reach = 0.75 * width + 0.06 * length;
      this.write(`${k + 1}`, [reach * Math.cos(angle), reach * Math.sin(angle), 0], { colour, size: 13, weight: 700 });
    });
  }

  grid(step, half) {
    const [faint, strong] = [[], []];
    const z = this.floor;
    for (let at = -half; at <= half + step / 4; at += step / 2) {
      const lines = Math.abs(at / step - Math.round(at / step)) < 1e-6 ? strong : faint;
      lines.push(at, -half, z, at, half, z, -half, at, z, half, at, z);
    }
    this.lines(faint, this.theme.grid, 0.55);
    this.lines(strong, this.theme.grid, 1);
    this.lines([-half, 0, z, half, 0, z, 0, -half, z, 0, half, z], this.theme.gridStrong, 1);
  }

  // Numbers stand beside their edge by their own size, which is the screen's, so that they never meet it.
  ticks(step, half, length) {
    const grey = { colour: this.theme.grey, size: 12, rank: LAST };
    const out = 0.03 * length;
    const z = this.floor;
    const below = [0.5, 0.9];
    const right = [-0.05, 0.6];
    const left = [1.05, 0.5];
    for (let at = -half; at <= half + step / 4; at += step) {
      const text = `${Number(at.toPrecision(6))}`;
      this.write(text, [at, -half - out, z], { ...grey, anchor: below });
      if (at > -half) this.write(text, [half + out, at, z], { ...grey, anchor: right });
    }
    const title = { ...grey, rank: LAST - 1 };
    this.write("x [mm]", [0, -half - out, z], { ...title, anchor: [0.5, 1.9] });
    this.write("y [mm]", [half + out, 0, z], { ...title, anchor: [-0.55, 0.6] });
    // A ruler upright in the far corner.
    const top = step * Math.ceil((1.2 * length) / step);
    const ruler = [-half, half, z, -half, half, top];
    for (let at = 0; at <= top + step / 4; at += step) {
      ruler.push(-half, half, at, -half - out, half, at);
      this.write(`${Number(at.toPrecision(6))}`, [-half - out, half, at], { ...grey, anchor: left });
    }
    this.write("z [mm]", [-half, half, top], { ...title, anchor: [0.5, -0.4] });
    this.lines(ruler, this.theme.gridStrong, 1);
  }

  plate(width) {
    const thickness = PLATE * width;
    const geometry = new THREE.CylinderGeometry(0.72 * width, 0.72 * width, thickness, 64);
    const material = new THREE.MeshPhongMaterial({ color: this.theme.plate, shininess: 12 });
    const mesh = new THREE.Mesh(geometry, material);
    mesh.rotation.x = Math.PI / 2;
    mesh.position.z = -thickness / 2 - 0.002 * width;
    this.group.add(mesh);
  }

  frame(size, width) {
    const from = 0.72 * width;
    const ends = [
      [from + size, 0, 0],
      [0, from + size, 0],
    ];
    this.lines([from, 0, 0, ...ends[0], 0, from, 0, ...ends[1]], this.theme.ink, 1);
    ["x", "y"].forEach((name, k) => {
      const cone = new THREE.Mesh(
        new THREE.ConeGeometry(0.07 * size, 0.24 * size, 16),
        new THREE.MeshBasicMaterial({ color: this.theme.ink }),
      );
      cone.position.set(...ends[k]);
      cone.quaternion.setFromUnitVectors(new THREE.Vector3(0, 1, 0), new THREE.Vector3(...ends[k]).normalize());
      this.group.add(cone);
      const place = ends[k].map((value) => value * (1 + (0.3 * size) / (from + size)));
      this.write(name, place, { colour: this.theme.ink, size: 12, weight: 600 });
    });
  }

  lines(numbers, colour, opacity) {
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.Float32BufferAttribute(numbers, 3));
    const material = new THREE.LineBasicMaterial({ color: colour, transparent: opacity < 1, opacity });
    this.group.add(new THREE.LineSegments(geometry, material));
  }

  // anchor: the point of the text that stands at the place, from its lower left (0, 0) to its upper right (1, 1).
  write(text, place, { colour, ...look }) {
    const label = new Label(look);
    label.write(text, colour, this.theme.halo);
    label.sprite.position.set(...place);
    this.group.add(label.sprite);
    this.labels.add(label);
    (this.own ??= []).push(label);
  }

  clear() {
    for (const label of this.own ?? []) {
      this.labels.delete(label);
      label.dispose();
    }
    this.own = [];
    for (const child of [...this.group.children]) {
      child.geometry?.dispose();
      child.material?.dispose();
      child.removeFromParent();
    }
  }
}
