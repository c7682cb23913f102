// What belongs to a study: the trail of the tip, a wall, a cloud of points, and targets.
import { THREE } from "nicegui-scene";
import { unpack } from "./unpack.js";

const TRAIL = 4000; // points kept
const TRAIL_STEP = 2e-3; // of L_0; nearer ones are left out

function disc() {
  const canvas = document.createElement("canvas");
  canvas.width = canvas.height = 32;
  const pen = canvas.getContext("2d");
  pen.fillStyle = "white";
  pen.beginPath();
  pen.arc(16, 16, 15, 0, 2 * Math.PI);
  pen.fill();
  return new THREE.CanvasTexture(canvas);
}

export class Marks {
  constructor(changed) {
    this.changed = changed;
    this.group = new THREE.Group();
    this.trail = new THREE.Line(
      new THREE.BufferGeometry().setAttribute(
        "position",
        new THREE.BufferAttribute(new Float32Array(3 * TRAIL), 3).setUsage(THREE.DynamicDrawUsage),
      ),
      new THREE.LineBasicMaterial(),
    );
    this.trail.frustumCulled = false;
    // A line of WebGL is one pixel wide, which is hard to see on a dense screen.
    this.trailDots = new THREE.Points(
      this.trail.geometry,
      new THREE.PointsMaterial({ size: 2.5, sizeAttenuation: false, map: disc(), alphaTest: 0.5 }),
    );
    this.trailDots.frustumCulled = false;
    this.length = 1;
    this.clearTrail();
    this.wall = this.makeWall();
    this.cloud = new THREE.Points(
      new THREE.BufferGeometry(),
      new THREE.PointsMaterial({ size: 5, sizeAttenuation: false, vertexColors: true, map: disc(), alphaTest: 0.5 }),
    );
    this.cloud.visible = false;
    this.targetMaterial = new THREE.MeshBasicMaterial();
    this.targets = new THREE.Group();
    this.cap = new THREE.Mesh(new THREE.CylinderGeometry(1, 1, 1, 24), new THREE.MeshPhongMaterial());
    this.cap.geometry.translate(0, 0.5, 0);
    this.cap.visible = false;
    this.group.add(this.trail, this.trailDots, this.wall, this.cloud, this.targets, this.cap);
  }

  makeWall() {
    const wall = new THREE.Group();
    const size = new THREE.PlaneGeometry(1, 1);
    this.wallFace = new THREE.MeshBasicMaterial({
      transparent: true,
      opacity: 0.22,
      side: THREE.DoubleSide,
      depthWrite: false,
    });
    this.wallEdge = new THREE.LineBasicMaterial();
    const face = new THREE.Mesh(size, this.wallFace);
    face.renderOrder = 6;
    const hatch = [];
    for (let k = -9; k <= 9; k++) {
      const [a, b] = [Math.max(-0.5, k / 10 - 0.5), Math.min(0.5, k / 10 + 0.5)];
      hatch.push(a, a - k / 10, 0, b, b - k / 10, 0);
    }
    this.wallHatch = new THREE.LineBasicMaterial({ transparent: true, opacity: 0.35 });
    const lines = new THREE.BufferGeometry().setAttribute("position", new THREE.Float32BufferAttribute(hatch, 3));
    wall.add(face, new THREE.LineSegments(new THREE.EdgesGeometry(size), this.wallEdge));
    wall.add(new THREE.LineSegments(lines, this.wallHatch));
    wall.visible = false;
    return wall;
  }

  // tip: twelve numbers of a station, see stationFrames.
  update(frame, tip, palette, theme) {
    this.length = frame.length;
    this.cap.visible = frame.cap > 0;
    this.cap.position.set(...tip.subarray(0, 3));
    this.cap.quaternion.setFromUnitVectors(new THREE.Vector3(0, 1, 0), new THREE.Vector3(...tip.subarray(9, 12)));
    this.cap.scale.set(0.1 * frame.width, Math.max(frame.cap, 1e-6), 0.1 * frame.width);
    this.palette = palette;
    this.wall.visible = frame.wall !== null;
    if (frame.wall !== null) {
      this.wall.position.set(...frame.wall.point);
      // Turned so that its lower edge is level.
      const normal = new THREE.Vector3(...frame.wall.normal);
      this.wall.up.set(...(Math.abs(normal.z) > 0.99 ? [1, 0, 0] : [0, 0, 1]));
      this.wall.lookAt(normal.add(this.wall.position));
      this.wall.scale.setScalar(1.1 * frame.length);
    }
    this.targets.children.forEach((mesh) => mesh.scale.setScalar(0.025 * frame.length));
    this.paint(theme);
  }

  paint(theme) {
    this.trail.material.color.set(this.palette?.[3] ?? theme.ink);
    this.trailDots.material.color.copy(this.trail.material.color);
    this.targetMaterial.color.set(this.palette?.[4] ?? theme.ink);
    this.cap.material.color.set(theme.plate);
    this.wallFace.color.set(theme.grey);
    this.wallEdge.color.set(theme.grey);
    this.wallHatch.color.set(theme.grey);
  }

  addToTrail(tip, length) {
    const { position } = this.trail.geometry.attributes;
    const places = position.array;
    if (this.count > 0) {
      const last = 3 * (this.count - 1);
      const moved = Math.hypot(tip[0] - places[last], tip[1] - places[last + 1], tip[2] - places[last + 2]);
      if (moved < TRAIL_STEP * length) return;
    }
    if (this.count === TRAIL) {
      places.copyWithin(0, 3 * (TRAIL / 4)); // the oldest quarter goes
      this.count -= TRAIL / 4;
    }
    places.set(tip, 3 * this.count++);
    position.needsUpdate = true;
    this.trail.geometry.setDrawRange(0, this.count);
  }

  clearTrail() {
    this.count = 0;
    this.trail.geometry.setDrawRange(0, 0);
    this.changed();
  }

  setPoints(message) {
    this.cloud.visible = message !== null;
    if (message !== null) {
      const geometry = new THREE.BufferGeometry();
      geometry.setAttribute("position", new THREE.BufferAttribute(unpack(message.points, Float32Array), 3));
      const colours = unpack(message.colours, Uint8Array);
      const linear = new Float32Array(colours.length);
      const colour = new THREE.Color();
      for (let k = 0; k < colours.length; k += 3) {
        colour.setRGB(colours[k] / 255, colours[k + 1] / 255, colours[k + 2] / 255, THREE.SRGBColorSpace);
        colour.toArray(linear, k);
      }
      geometry.setAttribute("color", new THREE.BufferAttribute(linear, 3));
      this.cloud.geometry.dispose();
      this.cloud.geometry = geometry;
    }
    this.changed();
  }

  setTargets(message) {
    this.targets.children.forEach((mesh) => mesh.geometry.dispose());
    this.targets.clear();
    const places = message === null ? [] : unpack(message.points, Float32Array);
    for (let k = 0; k < places.length; k += 3) {
      const mesh = new THREE.Mesh(new THREE.OctahedronGeometry(1), this.targetMaterial);
      mesh.position.set(places[k], places[k + 1], places[k + 2]);
      mesh.scale.setScalar(0.025 * this.length);
      this.targets.add(mesh);
    }
    this.changed();
  }
}
