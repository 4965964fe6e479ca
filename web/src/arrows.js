// Drives in the replay: force arrows, arcs for torques, and legs of distance drives.
import {
  ConeGeometry, Curve, CylinderGeometry, DoubleSide, Group, Mesh, MeshBasicMaterial,
  MeshStandardMaterial, SphereGeometry, TubeGeometry, Vector3,
} from 'three';

const kY = new Vector3(0, 1, 0), kZ = new Vector3(0, 0, 1);
const kArcSegments = 64;

class Arc extends Curve {
  constructor(radius, angle) {
    super();
    Object.assign(this, {radius, angle});
  }
  getPoint(t, target = new Vector3()) {
    return target.set(this.radius * Math.cos(t * this.angle), this.radius * Math.sin(t * this.angle), 0);
  }
}

/** The arrow of one drive with a ghost that bodies do not hide. `size` is its length at most. */
export class Arrow {
  constructor(turns, name, size, width) {
    Object.assign(this, {turns, size, headLength: 6 * width, radius: 0.4 * size, angle: 1.75 * Math.PI});
    this.solid = new MeshStandardMaterial({roughness: 0.5, emissiveIntensity: 0.35});
    this.ghost = new MeshBasicMaterial({transparent: true, opacity: 0.28, depthTest: false,
                                        depthWrite: false});
    if (turns) this.solid.side = this.ghost.side = DoubleSide;
    this.group = new Group();
    this.group.name = name;
    this.parts = [this.solid, this.ghost].map((material) => {
      const shaft = new Mesh(turns ? new TubeGeometry(new Arc(this.radius, this.angle), kArcSegments, width, 10)
                                   : new CylinderGeometry(width, width, 1, 20), material);
      const head = new Mesh(new ConeGeometry(2.6 * width, this.headLength, 24), material);
      this.group.add(shaft, head);
      return {shaft, head};
    });
  }

  /** Shows a force that is `share` of the largest one at the point `at` along `axis`. */
  show({at, axis}, force, share, color) {
    this.group.visible = Number.isFinite(force) && share > 1e-4;
    if (!this.group.visible) return;
    for (const target of [this.solid.color, this.solid.emissive, this.ghost.color]) target.copy(color);
    this.group.position.copy(at);
    this.group.quaternion.setFromUnitVectors(this.turns ? kZ : kY, axis);
    for (const parts of this.parts) {
      if (this.turns) this.bend(parts, share, force);
      else this.stretch(parts, share * this.size, force);
    }
  }

  // A push starts at the joint; a pull ends there, so that it stays visible.
  stretch({shaft, head}, length, force) {
    const headShare = Math.min(1, length / (1.3 * this.headLength));
    head.scale.setScalar(headShare);
    const h = this.headLength * headShare, shaftLength = Math.max(1e-9, length - h);
    shaft.scale.set(headShare, shaftLength, headShare);
    shaft.position.set(0, force >= 0 ? shaftLength / 2 : h + shaftLength / 2, 0);
    head.position.set(0, force >= 0 ? shaftLength + h / 2 : h / 2, 0);
    head.rotation.set(force >= 0 ? 0 : Math.PI, 0, 0);
  }

  bend({shaft, head}, share, force) {
    const segments = Math.max(1, Math.round(share * kArcSegments));
    shaft.geometry.setDrawRange(0, Math.round(shaft.geometry.index.count * segments / kArcSegments));
    const sign = force >= 0 ? 1 : -1;
    shaft.scale.set(1, sign, 1);
    const end = this.angle * segments / kArcSegments;
    head.position.set(this.radius * Math.cos(end), sign * this.radius * Math.sin(end), 0);
    head.rotation.set(0, 0, sign > 0 ? end : Math.PI - end);
  }
}

/** The massless leg of a distance drive: a rod that slides out of a sleeve. */
export class Leg {
  constructor(radius, shortest, dark, light) {
    this.sleeve = new Mesh(new CylinderGeometry(1.5 * radius, 1.5 * radius, 1, 24), dark);
    this.rod = new Mesh(new CylinderGeometry(radius, radius, 1, 24), light);
    this.ends = [0, 1].map(() => new Mesh(new SphereGeometry(1.7 * radius, 20, 14), dark));
    this.meshes = [this.sleeve, this.rod, ...this.ends];
    for (const mesh of this.meshes) mesh.castShadow = true;
    this.sleeveLength = 0.55 * shortest;
  }

  place({from, at, axis}) {
    const length = from.distanceTo(at);
    const between = (mesh, start, end) => {
      mesh.position.copy(from).addScaledVector(axis, (start + end) / 2);
      mesh.scale.set(1, Math.max(1e-6, end - start), 1);
      mesh.quaternion.setFromUnitVectors(kY, axis);
    };
    between(this.sleeve, 0, Math.min(this.sleeveLength, length));
    between(this.rod, Math.min(0.9 * this.sleeveLength, length), length);
    this.ends[0].position.copy(from);
    this.ends[1].position.copy(at);
  }
}
