// Parts of a mould: solids with a colour, each at one or several places, together or apart from each other.
import { THREE } from "nicegui-scene";
import { unpack } from "./unpack.js";

const radians = (degrees) => (degrees * Math.PI) / 180;

function geometryOf(message) {
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.BufferAttribute(unpack(message.points, Float32Array), 3));
  const Index = message.wide ? Uint32Array : Uint16Array;
  geometry.setIndex(new THREE.BufferAttribute(unpack(message.faces, Index), 1));
  geometry.computeBoundingSphere();
  return geometry;
}

function materialOf(message) {
  const clear = message.opacity < 1;
  return new THREE.MeshPhongMaterial({
    color: message.colour,
    flatShading: true,
    shininess: 18,
    opacity: message.opacity,
    transparent: clear,
    depthWrite: !clear,
    side: THREE.DoubleSide,
  });
}

export class Parts {
  // message: solids once each, and their places: solid, turn about z [deg], where it is, and where it goes when apart [mm].
  constructor(message) {
    this.group = new THREE.Group();
    this.geometries = message.solids.map(geometryOf);
    this.materials = message.solids.map(materialOf);
    this.places = message.places.map(({ solid, turn, at, apart }) => {
      const mesh = new THREE.Mesh(this.geometries[solid], this.materials[solid]);
      mesh.rotation.z = radians(turn);
      mesh.renderOrder = message.solids[solid].opacity < 1 ? 2 : 1;
      const way = new THREE.Vector3(...apart).applyAxisAngle(new THREE.Vector3(0, 0, 1), radians(turn));
      this.group.add(mesh);
      return { mesh, way, at: new THREE.Vector3(...at) };
    });
    this.explode(message.apart);
  }

  // How far the parts are from where they belong: 0 together, 1 apart.
  explode(share) {
    for (const { mesh, way, at } of this.places) mesh.position.copy(at).addScaledVector(way, share);
    this.group.updateMatrixWorld(true);
    this.sphere = new THREE.Box3().setFromObject(this.group).getBoundingSphere(new THREE.Sphere());
  }

  dispose() {
    this.group.removeFromParent();
    for (const owned of [...this.geometries, ...this.materials]) owned.dispose();
  }
}
