// The bodies of the replay: meshes by shape and paint, moved by the simulated poses.
import {
  BoxGeometry, BufferAttribute, BufferGeometry, CapsuleGeometry, Color, CylinderGeometry, DoubleSide,
  Group, Mesh, MeshStandardMaterial, Quaternion, SphereGeometry, SRGBColorSpace, Vector3,
} from 'three';

import {between} from './numbers.js';

const kY = new Vector3(0, 1, 0);

/** @param {import('./data.js').Surface} surface */
function geometryOf({vertices, triangles}) {
  const geometry = new BufferGeometry();
  geometry.setAttribute('position', new BufferAttribute(vertices, 3));
  geometry.setIndex(new BufferAttribute(triangles, 1));
  geometry.computeVertexNormals();
  return geometry;
}

export class Bodies {
  /** @param {import('./data.js').ReplayData} replay */
  constructor({bodies, paints, time, surfaces}) {
    this.bodies = bodies;
    this.surfaces = (surfaces ?? []).map(geometryOf);
    this.paints = paints;
    this.time = time;
    this.materials = new Map();
    this.groups = bodies.map((body) => {
      const group = new Group();
      group.name = body.name;
      for (const shape of body.shapes) group.add(this.mesh(shape));
      return group;
    });
  }

  /** Whether anything but the mechanism is drawn. */
  hasScenery() {
    return this.bodies.some((body) => body.shapes.some((shape) => this.paints[shape.color]?.scenery));
  }

  /**
   * Surroundings move with their bodies but are switched together.
   * @param {boolean} on
   */
  showScenery(on) {
    for (const group of this.groups) {
      for (const mesh of group.children) if (mesh.userData.scenery) mesh.visible = on;
    }
  }

  /**
   * @param {string} color a name of the paints
   * @param {boolean} faceted of a mesh, whose faces are seen as they are and from both sides
   */
  material(color, faceted = false) {
    const key = `${color} ${faceted}`;
    if (!this.materials.has(key)) {
      const paint = this.paints[color] ?? this.paints.grey;
      const [r, g, b, a] = paint.rgba;
      const opacity = color === 'sea' ? 0.55 * a : a;
      this.materials.set(key, new MeshStandardMaterial({
        ...(faceted ? {flatShading: true, side: DoubleSide} : {}),
        color: new Color().setRGB(r, g, b, SRGBColorSpace), roughness: 0.55, metalness: 0.1,
        transparent: opacity < 1, opacity, depthWrite: opacity === 1}));
    }
    return this.materials.get(key);
  }

  /** @param {any} shape of a body */
  mesh(shape) {
    let mesh;
    const material = this.material(shape.color);
    if (shape.type === 'box') {
      mesh = new Mesh(new BoxGeometry(...shape.size), material);
      mesh.position.set(...shape.pose.slice(0, 3));
      mesh.quaternion.set(...shape.pose.slice(3));
    } else if (shape.type === 'ball') {
      mesh = new Mesh(new SphereGeometry(shape.radius, 24, 16), material);
      mesh.position.set(...shape.at);
    } else if (shape.type === 'mesh') {
      mesh = new Mesh(this.surfaces[shape.surface], this.material(shape.color, true));
      mesh.position.set(...shape.pose.slice(0, 3));
      mesh.quaternion.set(...shape.pose.slice(3));
    } else {
      mesh = this.rod(shape, material);
    }
    mesh.userData.scenery = this.paints[shape.color]?.scenery === true;
    mesh.castShadow = !mesh.userData.scenery;
    mesh.receiveShadow = true;
    return mesh;
  }

  /** @param {any} shape a capsule or a cylinder @param {Three} material */
  rod({type, from, to, radius}, material) {
    const a = new Vector3(...from), axis = new Vector3(...to).sub(a);
    const length = axis.length();
    const geometry = type === 'capsule' ? new CapsuleGeometry(radius, length, 8, 20)
                                        : new CylinderGeometry(radius, radius, length, 32);
    const mesh = new Mesh(geometry, material);
    mesh.position.copy(a).addScaledVector(axis, 0.5);
    if (length > 0) mesh.quaternion.setFromUnitVectors(kY, axis.normalize());
    return mesh;
  }

  /**
   * Puts every body at a time, between two frames if need be.
   * @param {number} time [s]
   */
  pose(time) {
    const {from, to, share} = between(this.time, time);
    const p = new Vector3(), q = new Quaternion();
    this.bodies.forEach(({poses}, b) => {
      const at = (/** @type {number} */ frame) => poses.length === 7 ? 0 : 7 * frame;
      const [m, n] = [at(from), at(to)];
      this.groups[b].position.set(poses[m], poses[m + 1], poses[m + 2])
          .lerp(p.set(poses[n], poses[n + 1], poses[n + 2]), share);
      this.groups[b].quaternion.set(poses[m + 3], poses[m + 4], poses[m + 5], poses[m + 6])
          .slerp(q.set(poses[n + 3], poses[n + 4], poses[n + 5], poses[n + 6]), share);
      this.groups[b].updateMatrixWorld(true);
    });
  }

  /**
   * A point of a body in the world, at the pose shown.
   * @param {number} body
   * @param {Three} point
   */
  inWorld(body, point) {
    return point.applyMatrix4(this.groups[body].matrixWorld);
  }

  /** Corners of everything but the surroundings over the run, in the world; never empty. */
  points() {
    const points = [];
    const [start, end] = [this.time[0], this.time[this.time.length - 1]];
    for (let k = 0; k <= 8; ++k) {
      this.pose(start + (k / 8) * (end - start));
      for (const group of this.groups) {
        for (const mesh of group.children) {
          if (mesh.userData.scenery) continue;
          mesh.geometry.computeBoundingBox();
          const {min, max} = mesh.geometry.boundingBox;
          for (let c = 0; c < 8; ++c) {
            points.push(new Vector3(c & 1 ? max.x : min.x, c & 2 ? max.y : min.y, c & 4 ? max.z : min.z)
                            .applyMatrix4(mesh.matrixWorld));
          }
        }
      }
    }
    return points.length > 0 ? points : [new Vector3(-1, -1, -1), new Vector3(1, 1, 1)];
  }
}
