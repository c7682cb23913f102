// Loads as arrows with their size beside, made once for each kind and moved after that; and the frame of the tip.
// A moment is an arrow bent round its axis, by the rule of the right hand, wide enough to go round the body.
import { THREE } from "nicegui-scene";
import { Label } from "./label.js";

const UP = new THREE.Vector3(0, 1, 0);
const SHAFT = 0.022;
const TURN = 1.6 * Math.PI; // of a moment's arrow
const BEND = 0.7; // its radius
const AROUND = Array.from({ length: 12 }, (_, k) => [
  1.9 * BEND * Math.cos((k * Math.PI) / 6),
  0,
  1.9 * BEND * Math.sin((k * Math.PI) / 6),
]);

class Arrow {
  constructor(bent) {
    this.bent = bent;
    this.group = new THREE.Group();
    this.material = new THREE.MeshBasicMaterial();
    const shaft = bent
      ? new THREE.TorusGeometry(BEND, SHAFT, 10, 48, TURN).rotateX(-Math.PI / 2)
      : new THREE.CylinderGeometry(SHAFT, SHAFT, 0.8, 12).translate(0, 0.4, 0);
    const head = new THREE.Mesh(new THREE.ConeGeometry(0.075, 0.24, 20), this.material);
    if (bent) {
      head.position.set(BEND * Math.cos(TURN), 0, -BEND * Math.sin(TURN));
      head.quaternion.setFromUnitVectors(UP, new THREE.Vector3(-Math.sin(TURN), 0, -Math.cos(TURN)));
    } else head.position.y = 0.88;
    this.group.add(new THREE.Mesh(shaft, this.material), head);
    this.label = new Label({ size: 13, weight: 600, inFront: true, rank: 0 });
  }

  place({ start, vector, label, inwards }, colour, halo) {
    const along = new THREE.Vector3(...vector);
    const length = along.length();
    this.group.position.set(...start);
    this.group.quaternion.setFromUnitVectors(UP, along.clone().normalize());
    this.group.scale.setScalar(length);
    this.material.color.set(colour);
    this.label.write(label, colour, halo);
    const ends = this.bent ? AROUND : [[0, inwards ? -0.12 : 1.12, 0]];
    const places = ends.map((end) =>
      new THREE.Vector3(...end).multiplyScalar(length).applyQuaternion(this.group.quaternion).add(this.group.position),
    );
    // Beside a bent arrow on the side away from the body, which is that away from the base's axis.
    places.sort((a, b) => Math.hypot(b.x, b.y) - Math.hypot(a.x, a.y));
    this.label.sprite.position.copy(places[0]);
  }

  show(visible) {
    this.group.visible = visible;
    this.label.sprite.visible = visible;
  }
}

export class Arrows {
  constructor(labels) {
    this.labels = labels;
    this.group = new THREE.Group();
    this.kinds = new Map();
  }

  update(arrows, theme) {
    const seen = new Set();
    for (const arrow of arrows) {
      seen.add(arrow.kind);
      if (!this.kinds.has(arrow.kind)) {
        const made = new Arrow(arrow.kind === "moment");
        this.kinds.set(arrow.kind, made);
        this.labels.add(made.label);
        this.group.add(made.group, made.label.sprite);
      }
      this.kinds.get(arrow.kind).place(arrow, arrow.kind === "gravity" ? theme.grey : theme.ink, theme.halo);
    }
    for (const [kind, arrow] of this.kinds) arrow.show(seen.has(kind));
  }
}

export class TipFrame {
  constructor(labels) {
    this.group = new THREE.Group();
    this.position = new THREE.BufferAttribute(new Float32Array(18), 3);
    const geometry = new THREE.BufferGeometry().setAttribute("position", this.position);
    this.material = new THREE.LineBasicMaterial();
    const lines = new THREE.LineSegments(geometry, this.material);
    lines.frustumCulled = false;
    lines.renderOrder = 5;
    this.group.add(lines);
    this.letters = ["x", "y", "z"].map((name) => {
      const label = new Label({ size: 12, inFront: true, rank: 1 });
      label.name = name;
      labels.add(label);
      this.group.add(label.sprite);
      return label;
    });
  }

  // frame: twelve numbers of a station, see stationFrames.
  update(frame, size, theme) {
    this.material.color.set(theme.ink);
    const tip = frame.subarray(0, 3);
    this.letters.forEach((label, k) => {
      const axis = frame.subarray(3 + 3 * k, 6 + 3 * k);
      const end = (reach) => [0, 1, 2].map((c) => tip[c] + reach * size * axis[c]);
      this.position.array.set([...tip, ...end(1)], 6 * k);
      label.write(label.name, theme.ink, theme.halo);
      label.sprite.position.set(...end(1.28));
    });
    this.position.needsUpdate = true;
  }
}
