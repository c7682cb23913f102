// Loads as arrows with their size beside, made once for each kind and moved after that; and the frame of the tip.
import { THREE } from "nicegui-scene";
import { Label } from "./label.js";

const UP = new THREE.Vector3(0, 1, 0);

class Arrow {
  constructor(doubled) {
    this.group = new THREE.Group();
    this.material = new THREE.MeshBasicMaterial();
    this.shaft = new THREE.Mesh(new THREE.CylinderGeometry(0.022, 0.022, 1, 12), this.material);
    this.heads = Array.from({ length: doubled ? 2 : 1 }, () => {
      const head = new THREE.Mesh(new THREE.ConeGeometry(0.075, 0.24, 20), this.material);
      this.group.add(head);
      return head;
    });
    this.group.add(this.shaft);
    this.label = new Label({ size: 13, weight: 600, inFront: true });
  }

  place({ start, vector, label, inwards }, colour, halo) {
    const along = new THREE.Vector3(...vector);
    const length = along.length();
    this.group.position.set(...start);
    this.group.quaternion.setFromUnitVectors(UP, along.clone().normalize());
    this.group.scale.setScalar(length);
    this.shaft.scale.y = 0.8;
    this.shaft.position.y = 0.4;
    this.heads.forEach((head, k) => (head.position.y = 0.88 - 0.18 * k));
    this.material.color.set(colour);
    this.label.write(label, colour, halo);
    this.label.sprite.position.copy(along.multiplyScalar(inwards ? -0.12 : 1.12)).add(this.group.position);
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
      const label = new Label({ size: 12, inFront: true });
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
