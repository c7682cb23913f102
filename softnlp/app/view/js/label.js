// Text in the scene that keeps its size on the screen, drawn as a picture so that it is in exported pictures too.
import { THREE } from "nicegui-scene";

const SHARPNESS = 3; // pixels of the picture for each of the screen
const FONT = "system-ui, -apple-system, 'Segoe UI', Roboto, sans-serif";

export class Label {
  constructor({ size = 12, weight = 400, inFront = false } = {}) {
    this.size = size;
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
    const margin = 4 * SHARPNESS;
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
