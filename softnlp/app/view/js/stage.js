// The scene, its camera, and when it is drawn: once for each change, on the browser's next animation frame.
import { OrbitControls, THREE } from "nicegui-scene";
import { Arrows, TipFrame } from "./arrows.js";
import { Bodies, Ghosts, readRobot, readTube } from "./body.js";
import { stationFrames } from "./expand.js";
import { Label, spread } from "./label.js";
import { Marks } from "./marks.js";
import { Obstacles } from "./obstacles.js";
import { Parts } from "./parts.js";
import { Surroundings } from "./surroundings.js";
import { followTheme } from "./theme.js";

const FIELD = 28; // of view [deg]
const AZIMUTH = -60;
const ELEVATION = 17; // of the first view [deg]
const STEEP = 60; // above this the plane that is picked on lies level [deg]
const CLICK = 4; // a pointer that moves further is dragging [px]
const PICTURE_SCALE = 2;
const REST = 400; // after which a picture is smoothed, where that is not done for each frame [ms]

const radians = (degrees) => (degrees * Math.PI) / 180;

// How much further away the robot has to be seen from to fit the width of the picture.
const narrowness = (aspect) => Math.max(1, 1.5 / aspect);

function drawnInSoftware() {
  const gl = document.createElement("canvas").getContext("webgl2");
  const known = gl?.getExtension("WEBGL_debug_renderer_info");
  const name = known ? gl.getParameter(known.UNMASKED_RENDERER_WEBGL) : "";
  gl?.getExtension("WEBGL_lose_context")?.loseContext();
  return /swiftshader|llvmpipe|software|basic render/i.test(name);
}

export class Stage {
  constructor(element, emit) {
    this.element = element;
    this.emit = emit;
    // Without a graphics card smoothing doubles the time of a frame: what moves is drawn plain, what rests is smoothed.
    this.software = drawnInSoftware();
    this.renderer = new THREE.WebGLRenderer({ antialias: !this.software });
    this.ratio = this.software ? 1 : Math.min(window.devicePixelRatio, 2);
    this.renderer.setPixelRatio(this.ratio);
    const canvas = this.renderer.domElement;
    canvas.style.cssText = "position:absolute;inset:0;display:block";
    element.appendChild(canvas);
    this.scene = new THREE.Scene();
    this.camera = new THREE.PerspectiveCamera(FIELD, 1, 1, 1e4);
    this.light = new THREE.DirectionalLight(0xffffff, 1.6);
    this.scene.add(new THREE.HemisphereLight(0xffffff, 0xb8bcc4, 1.5), this.light);
    this.world = new THREE.Group(); // the robot and all around it; hidden while parts are shown
    this.scene.add(this.world);
    this.hold(false);
    this.labels = new Set();
    this.surroundings = new Surroundings(this.labels);
    this.arrows = new Arrows(this.labels);
    this.tipFrame = new TipFrame(this.labels);
    this.tipFrame.group.visible = false;
    this.marks = new Marks(() => this.request());
    this.obstacles = new Obstacles(this.labels, (moved) => this.emit("moved", moved));
    this.world.add(this.surroundings.group, this.arrows.group, this.tipFrame.group, this.marks.group);
    this.world.add(this.obstacles.group);
    this.followed = followTheme((theme) => this.paint(theme));
    this.paint(this.followed.theme);
    this.listen(canvas);
    this.sizes = new ResizeObserver(() => this.resize());
    this.sizes.observe(element);
    this.resize();
  }

  // Which way is up; the controls read it once.
  hold(hanging) {
    this.controls?.dispose();
    this.camera.up.set(0, 0, hanging ? -1 : 1);
    this.controls = new OrbitControls(this.camera, this.renderer.domElement);
    this.controls.enableDamping = true;
    this.controls.dampingFactor = 0.15;
    this.controls.addEventListener("change", () => this.request());
  }

  setRobot(message) {
    this.body?.dispose();
    this.ghost?.dispose();
    const pieces = message.pieces.map(readRobot);
    this.robot = pieces[0];
    this.palette = message.palette;
    this.body = new Bodies(pieces, this.theme);
    this.ghost = new Ghosts(pieces, this.theme);
    this.world.add(this.body.group, this.ghost.group);
  }

  // Bodies that stay, each a ghost of its own robot with a letter at its tip.
  setPins(messages) {
    for (const { ghost, label } of this.pins ?? []) {
      ghost.dispose();
      this.labels.delete(label);
      label.dispose();
    }
    this.pins = messages.map((message) => {
      const tube = readTube(message.tube);
      const ghost = new Ghosts(message.robot.pieces.map(readRobot), this.theme, message.colour);
      ghost.update(tube);
      const label = new Label({ size: 15, weight: 700, inFront: true, rank: 1 });
      label.write(message.label, this.theme.ink, this.theme.halo);
      label.sprite.position.set(...tube.axis.subarray(-7, -4));
      this.labels.add(label);
      ghost.group.add(label.sprite);
      this.world.add(ghost.group);
      return { ghost, label, text: message.label };
    });
    this.rescale();
    this.request();
  }

  setObstacles(message) {
    this.obstacles.set(message, this.theme);
    this.rescale();
    this.request();
  }

  // Choose an obstacle, or move the chosen one in the plane of the picture [mm]; what is chosen in words, false for none.
  nudge(name) {
    if (name === "next") {
      const words = this.obstacles.next();
      this.obstacles.paint(this.theme);
      this.request();
      return words;
    }
    const turns = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
    const { chosen } = this.obstacles;
    if (turns[name] === undefined || chosen < 0) return false;
    const across = new THREE.Vector3().setFromMatrixColumn(this.camera.matrixWorld, 0);
    const up = new THREE.Vector3().setFromMatrixColumn(this.camera.matrixWorld, 1);
    const by = across.multiplyScalar(turns[name][0]).addScaledVector(up, turns[name][1]);
    this.emit("moved", { number: chosen, by: by.toArray(), done: true });
    return this.obstacles.made[chosen].name;
  }

  // Parts in place of the robot, or the robot again for null. Other parts keep the direction from which they are seen.
  setParts(message) {
    const before = this.parts ?? null;
    if (before === null && message === null) return;
    before?.dispose();
    this.parts = message === null ? null : new Parts(message);
    this.world.visible = this.parts === null;
    this.element.dataset.parts = message?.name ?? "";
    if (this.parts !== null) this.scene.add(this.parts.group);
    if (before === null || this.parts === null) {
      this.hold(this.upsideDown);
      this.reset();
      this.rescale();
    } else this.follow();
    this.request();
  }

  explode(share) {
    this.parts?.explode(share);
    this.follow();
    this.request();
  }

  // See all parts from where the user left the camera.
  follow() {
    if (!this.parts) return;
    const away = this.camera.position.clone().sub(this.controls.target).normalize();
    this.lookAtParts(away);
  }

  lookAtParts(away) {
    const { center, radius } = this.parts.sphere;
    const distance = (1.05 * radius * Math.max(1, 1 / this.camera.aspect)) / Math.sin(radians(FIELD / 2));
    this.controls.target.copy(center);
    this.camera.position.copy(center).addScaledVector(away, distance);
    this.limit(radius);
    this.controls.update();
  }

  get upsideDown() {
    return !this.parts && (this.frame?.hanging ?? false);
  }

  // Only kept here: of several that come before the next animation frame the last is drawn, and the tip of each.
  show(frame) {
    this.next = { ...frame, body: readTube(frame.body), ghost: readTube(frame.ghost) };
    this.marks.addToTrail(this.next.body.axis.subarray(-7, -4), frame.length);
    this.request();
  }

  apply(frame) {
    const tip = stationFrames(frame.body.axis.subarray(-7));
    this.body.update(frame.body, frame.level);
    this.ghost.update(frame.ghost);
    this.tipFrame.group.visible = true;
    this.tipFrame.update(tip, 0.16 * frame.length, this.theme);
    this.arrows.update(frame.arrows, this.theme);
    this.marks.update(frame, tip, this.palette, this.theme);
    this.surroundings.build(frame.length, frame.width, this.robot.sets, this.theme);
    const before = this.frame;
    this.frame = frame;
    this.tip = [...tip.subarray(0, 3)];
    const turned = (before?.hanging ?? false) !== frame.hanging;
    if (this.parts) return;
    if (turned) this.hold(frame.hanging);
    if (before === undefined || turned) this.reset();
    else if (before.length !== frame.length) this.grow(frame.length / before.length);
    this.rescale();
  }

  // A longer robot is seen from further away, in the direction in which the user left the camera.
  grow(factor) {
    this.camera.position.multiplyScalar(factor);
    this.controls.target.multiplyScalar(factor);
    this.limit(this.frame.length);
  }

  limit(size) {
    this.camera.near = size / 50;
    this.camera.far = 60 * size;
    this.camera.updateProjectionMatrix();
    this.controls.minDistance = 0.3 * size;
    this.controls.maxDistance = 25 * size;
  }

  reset() {
    if (this.frame === undefined && !this.parts) return;
    // What is left of the swing of a drag would go on after it.
    this.controls.enableDamping = false;
    this.controls.update();
    this.controls.enableDamping = true;
    const [a, e] = [radians(AZIMUTH), radians(ELEVATION)];
    if (this.parts) {
      this.lookAtParts(new THREE.Vector3(Math.cos(e) * Math.cos(a), Math.cos(e) * Math.sin(a), Math.sin(e)));
      this.request();
      return;
    }
    const size = this.frame.length;
    const away = 4.1 * size * narrowness(this.camera.aspect);
    this.controls.target.set(0, 0, 0.45 * size);
    this.camera.position.set(Math.cos(e) * Math.cos(a), Math.cos(e) * Math.sin(a), Math.sin(e) * this.camera.up.z);
    this.camera.position.multiplyScalar(away).add(this.controls.target);
    this.limit(size);
    this.controls.update();
    this.request();
  }

  // Turn or zoom by a key of the keyboard; false for another one.
  key(name) {
    const turns = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
    const away = this.camera.position.clone().sub(this.controls.target);
    if (name === "Home") this.reset();
    else if (name === "+" || name === "=" || name === "-") away.multiplyScalar(name === "-" ? 1 / 0.9 : 0.9);
    else if (turns[name] !== undefined) {
      const [a, e] = turns[name];
      const axis = new THREE.Vector3().crossVectors(this.camera.up, away).normalize();
      const angle = away.angleTo(this.camera.up) + 0.12 * e;
      away.applyAxisAngle(this.camera.up, 0.12 * a);
      if (angle > 0.05 && angle < Math.PI - 0.05) away.applyAxisAngle(axis, 0.12 * e);
    } else return false;
    if (name !== "Home") this.camera.position.copy(this.controls.target).add(away);
    this.controls.update();
    this.request();
    return true;
  }

  paint(theme) {
    this.theme = theme;
    this.scene.background = new THREE.Color(theme.background);
    this.body?.paint(theme);
    this.ghost?.paint(theme);
    for (const { ghost, label, text } of this.pins ?? []) {
      ghost.paint(theme);
      label.write(text, theme.ink, theme.halo);
    }
    this.marks.paint(theme);
    this.obstacles.paint(theme);
    if (this.frame !== undefined) this.next ??= this.frame;
    this.request();
  }

  request() {
    this.pending ??= requestAnimationFrame(() => this.draw());
  }

  draw() {
    this.pending = undefined;
    const frame = this.next;
    this.next = undefined;
    if (frame !== undefined && this.body !== undefined) this.apply(frame);
    this.controls.update();
    this.render(this.ratio);
    if (frame !== undefined) this.element.dataset.frame = frame.id;
    if (!this.software) return;
    clearTimeout(this.rest);
    this.rest = setTimeout(() => this.render(PICTURE_SCALE), REST);
  }

  render(ratio) {
    if (this.renderer.getPixelRatio() !== ratio) this.renderer.setPixelRatio(ratio);
    this.light.position.copy(this.camera.position).addScaledVector(this.camera.up, this.camera.position.length());
    this.scene.updateMatrixWorld();
    this.camera.updateMatrixWorld();
    spread(this.labels, this.camera, this.element.clientWidth, this.element.clientHeight);
    this.renderer.render(this.scene, this.camera);
  }

  resize() {
    const { clientWidth: width, clientHeight: height } = this.element;
    if (width === 0 || height === 0) return;
    this.renderer.setSize(width, height);
    const nearer = narrowness(width / height) / narrowness(this.camera.aspect);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    // In another window the robot still fills as much of it.
    this.camera.position.sub(this.controls.target).multiplyScalar(nearer).add(this.controls.target);
    this.rescale();
    this.request();
  }

  // Labels keep their size on the screen.
  rescale() {
    const unit = (2 * Math.tan(radians(FIELD / 2))) / Math.max(1, this.element.clientHeight);
    for (const label of this.labels) label.scale(unit);
  }

  picture() {
    this.draw();
    this.render(PICTURE_SCALE);
    const url = this.renderer.domElement.toDataURL("image/png");
    this.request();
    return url;
  }

  listen(canvas) {
    let start = null;
    canvas.addEventListener("pointerdown", (event) => {
      start = event.button === 0 ? [event.clientX, event.clientY] : null;
      if (start === null || this.parts || !this.obstacles.take(this.caster(event), this.camera)) return;
      this.controls.enabled = false;
      canvas.setPointerCapture(event.pointerId);
      this.obstacles.paint(this.theme);
      this.request();
    });
    canvas.addEventListener("pointermove", (event) => {
      if (this.obstacles.drag === null) return;
      const far = Math.hypot(event.clientX - start[0], event.clientY - start[1]) > CLICK;
      if (!far && !this.obstacles.drag.moved) return;
      this.obstacles.pull(this.caster(event));
      this.request();
    });
    canvas.addEventListener("pointercancel", () => {
      this.obstacles.drop();
      this.controls.enabled = true;
    });
    canvas.addEventListener("pointerup", (event) => {
      this.controls.enabled = true;
      if (this.obstacles.drop()) return;
      if (start === null || Math.hypot(event.clientX - start[0], event.clientY - start[1]) > CLICK) return;
      const picked = this.pick(this.caster(event));
      if (picked !== null && !this.parts) this.emit("pick", picked);
    });
    canvas.addEventListener("webglcontextlost", (event) => event.preventDefault());
    canvas.addEventListener("webglcontextrestored", () => this.request());
  }

  // The line of sight through a pointer.
  caster(event) {
    const box = this.renderer.domElement.getBoundingClientRect();
    const at = [(2 * (event.clientX - box.left)) / box.width - 1, 1 - (2 * (event.clientY - box.top)) / box.height];
    const caster = new THREE.Raycaster();
    caster.setFromCamera(new THREE.Vector2(...at), this.camera);
    return caster;
  }

  // A line of sight to a point on the plane through the robot that faces the viewer, and the line of sight.
  pick(caster) {
    const towards = this.camera.getWorldDirection(new THREE.Vector3());
    const steep = Math.abs(towards.z) > Math.sin(radians(STEEP));
    const normal = steep ? new THREE.Vector3(0, 0, 1) : new THREE.Vector3(towards.x, towards.y, 0).normalize();
    const through = new THREE.Vector3(0, 0, steep ? (this.tip?.[2] ?? 0) : 0);
    const plane = new THREE.Plane().setFromNormalAndCoplanarPoint(normal, through);
    const point = caster.ray.intersectPlane(plane, new THREE.Vector3());
    if (point === null) return null;
    const { origin, direction } = caster.ray;
    return { x: point.x, y: point.y, z: point.z, from: origin.toArray(), along: direction.toArray() };
  }

  dispose() {
    cancelAnimationFrame(this.pending);
    clearTimeout(this.rest);
    this.followed.stop();
    this.sizes.disconnect();
    this.controls.dispose();
    this.surroundings.clear();
    this.body?.dispose();
    this.ghost?.dispose();
    this.setPins([]);
    this.obstacles.clear();
    this.parts?.dispose();
    for (const label of this.labels) label.dispose();
    this.renderer.dispose();
    this.renderer.forceContextLoss(); // a browser has few of them
    this.renderer.domElement.remove();
  }
}
