// A robot's body: one buffer of vertices that all its surfaces share, written again for every frame.
import { THREE } from "nicegui-scene";
import { expand } from "./expand.js";
import { unpack } from "./unpack.js";

// Silicone is clear where one looks straight at it and milky at its edges.
const VERTEX = `
  varying vec3 vNormal;
  varying vec3 vToEye;
  void main() {
    vec4 seen = modelViewMatrix * vec4(position, 1.0);
    vNormal = normalMatrix * normal;
    vToEye = -seen.xyz;
    gl_Position = projectionMatrix * seen;
  }`;
const FRAGMENT = `
  uniform vec3 face;
  uniform vec3 rim;
  uniform vec2 alpha;
  varying vec3 vNormal;
  varying vec3 vToEye;
  void main() {
    vec3 n = normalize(vNormal);
    float edge = pow(1.0 - abs(dot(n, normalize(vToEye))), 2.2);
    float light = 0.86 + 0.14 * abs(dot(n, normalize(vec3(0.3, 0.7, 0.6))));
    gl_FragColor = vec4(mix(face, rim, edge) * light, mix(alpha.x, alpha.y, edge));
    #include <colorspace_fragment>
  }`;

function silicone(alphaFacing, alphaEdge, side) {
  return new THREE.ShaderMaterial({
    vertexShader: VERTEX,
    fragmentShader: FRAGMENT,
    uniforms: {
      face: { value: new THREE.Color() },
      rim: { value: new THREE.Color() },
      alpha: { value: new THREE.Vector2(alphaFacing, alphaEdge) },
    },
    transparent: true,
    depthWrite: false,
    side,
  });
}

export function readRobot(message) {
  const mesh = {
    station: unpack(message.station, Uint16Array),
    centre: unpack(message.centre, Float32Array),
    around: unpack(message.around, Float32Array),
    radius: unpack(message.radius, Uint8Array),
    normal: unpack(message.normal, Int8Array),
  };
  const Index = message.wide ? Uint32Array : Uint16Array;
  const parts = message.parts.map((part) => ({ ...part, faces: unpack(part.faces, Index) }));
  return { mesh, parts, sets: message.sets, before: message.before ?? 0 };
}

// A tube with its parts, of several segments, each with its own axis.
export function readTube(message) {
  if (message === null) return null;
  return { ...message, axis: unpack(message.axis, Float32Array), parts: (message.parts ?? []).map(readTube) };
}

// The tube of one piece of a body: its part, or the whole of a body of one.
const pieceOf = (tube, k) => (tube === null ? null : (tube.parts[k] ?? tube));

// Bodies one behind the other, each a robot of its own; what joins them is drawn as rods.
class Pieces {
  constructor(made) {
    this.pieces = made;
    this.group = new THREE.Group();
    for (const piece of made) this.group.add(piece.group);
  }

  paint(theme) {
    for (const piece of this.pieces) piece.paint(theme);
  }

  dispose() {
    this.group.removeFromParent();
    for (const piece of this.pieces) piece.dispose();
  }
}

export class Bodies extends Pieces {
  constructor(robots, theme) {
    super(robots.map((robot) => new Body(robot, theme)));
    this.rods = robots.map(() => new THREE.Mesh(new THREE.CylinderGeometry(1, 1, 1, 24), new THREE.MeshPhongMaterial()));
    this.group.add(...this.rods);
    this.paint(theme);
  }

  update(tube, level) {
    this.pieces.forEach((piece, k) => {
      const { before, sets } = piece.robot;
      piece.update(pieceOf(tube, k), level.slice(before, before + sets.length));
    });
    this.rods.forEach((rod, k) => this.join(rod, tube, k));
  }

  // A connector, from the end of a part to the next one, or to the tip.
  join(rod, tube, k) {
    const part = tube.parts[k];
    rod.visible = part !== undefined;
    if (!rod.visible) return;
    const from = new THREE.Vector3(...part.axis.subarray(-7, -4));
    const end = tube.parts[k + 1];
    const to = new THREE.Vector3(...(end ? end.axis.subarray(0, 3) : tube.axis.subarray(-7, -4)));
    const way = to.clone().sub(from);
    const outer = part.radii[0];
    const radius = 0.35 * (typeof outer === "number" ? outer : outer[outer.length - 1]);
    rod.visible = way.length() > 1e-3;
    rod.position.copy(from).addScaledVector(way, 0.5);
    rod.scale.set(radius, way.length(), radius);
    rod.quaternion.setFromUnitVectors(new THREE.Vector3(0, 1, 0), way.normalize());
  }

  paint(theme) {
    super.paint(theme);
    for (const rod of this.rods ?? []) rod.material.color.set(theme.plate);
  }

  dispose() {
    super.dispose();
    for (const rod of this.rods) {
      rod.geometry.dispose();
      rod.material.dispose();
    }
  }
}

export class Ghosts extends Pieces {
  constructor(robots, theme, colour = null) {
    super(robots.map((robot) => new Ghost(robot, theme, colour)));
  }

  update(tube) {
    this.pieces.forEach((piece, k) => piece.update(pieceOf(tube, k)));
  }
}

class Body {
  constructor(robot, theme) {
    this.robot = robot;
    this.group = new THREE.Group();
    const count = robot.mesh.station.length;
    this.position = new THREE.BufferAttribute(new Float32Array(3 * count), 3).setUsage(THREE.DynamicDrawUsage);
    this.normal = new THREE.BufferAttribute(new Float32Array(3 * count), 3).setUsage(THREE.DynamicDrawUsage);
    this.silicone = {
      back: silicone(0.26, 0.62, THREE.BackSide),
      front: silicone(0.07, 0.72, THREE.FrontSide),
      lumen: silicone(0.06, 0.4, THREE.DoubleSide),
    };
    this.sets = robot.sets.map(
      () =>
        // In front of the end faces, in which the discs of the chambers lie.
        new THREE.MeshPhongMaterial({ shininess: 40, polygonOffset: true, polygonOffsetFactor: -1, polygonOffsetUnits: -2 }),
    );
    this.level = robot.sets.map(() => 0);
    for (const part of robot.parts) this.addPart(part);
    this.paint(theme);
  }

  addPart({ kind, set, faces }) {
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", this.position);
    geometry.setAttribute("normal", this.normal);
    geometry.setIndex(new THREE.BufferAttribute(faces, 1));
    const add = (material, order) => {
      const mesh = new THREE.Mesh(geometry, material);
      mesh.renderOrder = order;
      mesh.frustumCulled = false; // its bounds are not followed
      mesh.name = kind;
      this.group.add(mesh);
    };
    if (kind === "chamber") add(this.sets[set], 2);
    else if (kind === "lumen") add(this.silicone.lumen, 3);
    else {
      add(this.silicone.back, 1);
      add(this.silicone.front, 4);
    }
  }

  update(tube, level) {
    expand(this.robot.mesh, tube, this.position.array, this.normal.array);
    this.position.needsUpdate = true;
    this.normal.needsUpdate = true;
    this.level = level;
    this.paintSets();
  }

  paint(theme) {
    this.theme = theme;
    for (const material of Object.values(this.silicone)) {
      material.uniforms.face.value.set(theme.silicone);
      material.uniforms.rim.value.set(theme.rim);
    }
    this.paintSets();
  }

  // A chamber without pressure is pale; with it the colour of its set comes out.
  paintSets() {
    const idle = new THREE.Color(this.theme.idle);
    this.sets.forEach((material, k) => {
      const level = this.level[k];
      const full = new THREE.Color(this.robot.sets[k].colour);
      material.color.copy(idle).lerp(full, level > 0 ? 0.42 + 0.58 * level : 0.3);
      material.emissive.copy(full).multiplyScalar(0.22 * level);
    });
  }

  dispose() {
    this.group.removeFromParent();
    for (const mesh of this.group.children) mesh.geometry.dispose();
    for (const material of [...Object.values(this.silicone), ...this.sets]) material.dispose();
  }
}

// Another shape: the outer surface of a robot alone, faint. colour: its own, or that of the theme.
class Ghost {
  constructor(robot, theme, colour = null) {
    this.robot = robot;
    this.colour = colour;
    this.position = new THREE.BufferAttribute(new Float32Array(3 * robot.mesh.station.length), 3);
    this.normal = new THREE.BufferAttribute(new Float32Array(3 * robot.mesh.station.length), 3);
    this.material = colour === null ? silicone(0.1, 0.6, THREE.FrontSide) : silicone(0.28, 0.85, THREE.FrontSide);
    this.group = new THREE.Group();
    for (const part of robot.parts.filter((p) => p.kind === "outer" || p.kind === "end")) {
      const geometry = new THREE.BufferGeometry();
      geometry.setAttribute("position", this.position);
      geometry.setAttribute("normal", this.normal);
      geometry.setIndex(new THREE.BufferAttribute(part.faces, 1));
      const mesh = new THREE.Mesh(geometry, this.material);
      mesh.frustumCulled = false;
      mesh.renderOrder = 0;
      this.group.add(mesh);
    }
    this.group.visible = false;
    this.paint(theme);
  }

  update(tube) {
    this.group.visible = tube !== null;
    if (tube === null) return;
    expand(this.robot.mesh, tube, this.position.array, this.normal.array);
    this.position.needsUpdate = true;
    this.normal.needsUpdate = true;
  }

  paint(theme) {
    this.material.uniforms.face.value.set(this.colour ?? theme.ghost);
    this.material.uniforms.rim.value.set(this.colour ?? theme.ghost);
  }

  dispose() {
    this.group.removeFromParent();
    for (const mesh of this.group.children) mesh.geometry.dispose();
    this.material.dispose();
  }
}
