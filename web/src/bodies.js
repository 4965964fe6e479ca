// The bodies of the replay: meshes by shape and paint, moved by the simulated poses.
import {
  BoxGeometry, CapsuleGeometry, Color, CylinderGeometry, Group, Mesh, MeshStandardMaterial,
  Quaternion, SphereGeometry, SRGBColorSpace, Vector3,
} from 'three';

import {indexAt} from './data.js';

const kY = new Vector3(0, 1, 0);

export class Bodies {
  constructor({bodies, paints, time}) {
    Object.assign(this, {bodies, paints, time, materials: new Map()});
    this.groups = bodies.map((body) => {
      const group = new Group();
      group.name = body.name;
      for (const shape of body.shapes) group.add(this.mesh(shape));
      return group;
    });
  }

  /** Surroundings move with their bodies but are switched together. */
  showScenery(on) {
    for (const group of this.groups) {
      for (const mesh of group.children) if (mesh.userData.scenery) mesh.visible = on;
    }
  }

  material(color) {
    if (!this.materials.has(color)) {
      const paint = this.paints[color] ?? this.paints.grey;
      const [r, g, b, a] = paint.rgba;
      const sea = color === 'sea';
      const opacity = sea ? 0.55 * a : a;
      this.materials.set(color, new MeshStandardMaterial({
        color: new Color().setRGB(r, g, b, SRGBColorSpace), roughness: 0.55, metalness: 0.1,
        transparent: opacity < 1, opacity, depthWrite: opacity === 1}));
    }
    return this.materials.get(color);
  }

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
    } else {
      mesh = this.rod(shape, material);
    }
    mesh.userData.scenery = (this.paints[shape.color] ?? {}).scenery === true;
    mesh.castShadow = !mesh.userData.scenery;
    mesh.receiveShadow = true;
    return mesh;
  }

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

  /** Puts every body at a time, between two frames if need be. */
  pose(time) {
    const {time: times, bodies} = this;
    const i = indexAt(times, time);
    const j = Math.min(i + 1, times.length - 1);
    const share = j === i ? 0 : Math.min(1, Math.max(0, (time - times[i]) / (times[j] - times[i])));
    const p = new Vector3(), q = new Quaternion();
    bodies.forEach(({poses}, b) => {
      const at = (frame) => poses.length === 7 ? 0 : 7 * frame;
      const [m, n] = [at(i), at(j)];
      this.groups[b].position.set(poses[m], poses[m + 1], poses[m + 2])
          .lerp(p.set(poses[n], poses[n + 1], poses[n + 2]), share);
      this.groups[b].quaternion.set(poses[m + 3], poses[m + 4], poses[m + 5], poses[m + 6])
          .slerp(q.set(poses[n + 3], poses[n + 4], poses[n + 5], poses[n + 6]), share);
      this.groups[b].updateMatrixWorld(true);
    });
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
