// Text in the scene that keeps its size on the screen, drawn as a picture so that it is in exported pictures too.
import { THREE } from "nicegui-scene";

const SHARPNESS = 3; // pixels of the picture for each of the screen
export const LAST = 3; // rank of labels that are left out where there is no room
const FONT = "system-ui, -apple-system, 'Segoe UI', Roboto, sans-serif";

const MARGIN = 4; // about the letters, for their halo [px]
const ASIDE = [
  ...[[0, 0], [0, -1], [0, 1], [0, -2], [0, 2], [1, 0], [-1, 0], [1, -1], [-1, -1], [1, 1], [-1, 1]],
  ...[[1, -2], [-1, -2], [1, 2], [-1, 2], [0, -3], [0, 3], [2, 0], [-2, 0]],
];

// Move labels of low rank aside where they would stand over those before them, and leave out those of the last rank.
export function spread(labels, camera, width, height) {
  const taken = [];
  const place = new THREE.Vector3();
  for (const label of [...labels].sort((a, b) => a.rank - b.rank)) {
    const { sprite, home } = label;
    let shown = true;
    for (let node = sprite.parent; node !== null; node = node.parent) shown &&= node.visible;
    if (!shown || (label.rank < LAST && !sprite.visible)) continue;
    sprite.getWorldPosition(place).project(camera);
    const [w, h] = [label.canvas.width / SHARPNESS, label.canvas.height / SHARPNESS];
    const [x, y] = [((place.x + 1) / 2) * width - home.x * w, ((1 - place.y) / 2) * height - (1 - home.y) * h];
    const tries = label.rank < LAST ? ASIDE : ASIDE.slice(0, 1);
    const boxes = tries.map(([i, j]) => {
      const [left, top] = [x + 0.7 * i * w + MARGIN, y + 0.8 * j * h + MARGIN];
      return [left, top, left + w - 2 * MARGIN, top + h - 2 * MARGIN];
    });
    const free = boxes.findIndex((a) => taken.every((b) => a[0] > b[2] || b[0] > a[2] || a[1] > b[3] || b[1] > a[3]));
    if (label.rank === LAST) sprite.visible = free === 0;
    const [i, j] = tries[Math.max(free, 0)];
    sprite.center.set(home.x - 0.7 * i, home.y + 0.8 * j);
    if (free >= 0) taken.push(boxes[free]);
  }
}

export class Label {
  // rank: which label gives way where two would stand in one place; the larger one, of LAST it is left out.
  constructor({ size = 12, weight = 400, inFront = false, rank = 2, anchor = [0.5, 0.5] } = {}) {
    this.size = size;
    this.rank = rank;
    this.home = new THREE.Vector2(...anchor);
    this.weight = weight;
    this.canvas = document.createElement("canvas");
    this.material = new THREE.SpriteMaterial({
      transparent: true,
      sizeAttenuation: false,
      depthWrite: false,
      depthTest: !inFront,
      premultipliedAlpha: true, // else the clear pixels around the letters darken their edges
    });
    this.sprite = new THREE.Sprite(this.material);
    this.sprite.renderOrder = 20;
    this.sprite.center.copy(this.home);
    this.key = null;
    this.unit = 1;
  }

  write(text, colour, halo) {
    const key = `${text}|${colour}|${halo}`;
    if (key === this.key) return;
    this.key = key;
    const font = `${this.weight} ${this.size * SHARPNESS}px ${FONT}`;
    const pen = this.canvas.getContext("2d");
    pen.font = font;
    const margin = MARGIN * SHARPNESS;
    this.canvas.width = Math.ceil(pen.measureText(text).width) + 2 * margin;
    this.canvas.height = Math.ceil(1.3 * this.size * SHARPNESS) + 2 * margin;
    pen.font = font;
    pen.textAlign = "center";
    pen.textBaseline = "middle";
    pen.lineJoin = "round";
    pen.lineWidth = 3 * SHARPNESS;
    pen.strokeStyle = halo;
    pen.strokeText(text, this.canvas.width / 2, this.canvas.height / 2);
    pen.fillStyle = colour;
    pen.fillText(text, this.canvas.width / 2, this.canvas.height / 2);
    // A texture cannot change its size, so a new text gets a new one.
    this.material.map?.dispose();
    this.material.map = new THREE.CanvasTexture(this.canvas);
    this.material.map.colorSpace = THREE.SRGBColorSpace;
    this.material.map.premultiplyAlpha = true;
    this.material.needsUpdate = true;
    this.scale(this.unit);
  }

  // unit: size of a pixel of the screen at distance 1 from the camera
  scale(unit) {
    this.unit = unit;
    const factor = unit / SHARPNESS;
    this.sprite.scale.set(this.canvas.width * factor, this.canvas.height * factor, 1);
  }

  dispose() {
    this.material.map?.dispose();
    this.material.dispose();
    this.sprite.removeFromParent();
  }
}
