// Drives in the replay: force arrows, arcs for torques, and legs of distance drives.
import {
  ConeGeometry, Curve, CylinderGeometry, DoubleSide, Group, Mesh, MeshBasicMaterial,
  MeshStandardMaterial, SphereGeometry, TubeGeometry, Vector3,
} from 'three';

import {bentArrow, legParts, straightArrow} from './arrow_shape.js';

const kY = new Vector3(0, 1, 0), kZ = new Vector3(0, 0, 1);
const kArcSegments = 64;

class ArcCurve extends Curve {
  /** @param {number} radius @param {number} angle [m, rad] */
  constructor(radius, angle) {
    super();
    this.radius = radius;
    this.angle = angle;
  }
  /** @param {number} t 0 … 1 */
  getPoint(t, target = new Vector3()) {
    return target.set(this.radius * Math.cos(t * this.angle), this.radius * Math.sin(t * this.angle), 0);
  }
}

/**
 * Where a drive is: the point at which its force acts, its direction, and where a distance starts.
 * @typedef {{from: Three, at: Three, axis: Three}} DrivePlace
 */

/** The arrow of one drive with a ghost that bodies do not hide. */
export class Arrow {
  /** @param {boolean} turns @param {string} name @param {number} size length at most [m] @param {number} width [m] */
  constructor(turns, name, size, width) {
    this.turns = turns;
    this.size = size;
    this.headLength = 6 * width;
    this.arc = {radius: 0.4 * size, angle: 1.75 * Math.PI, segments: kArcSegments};
    this.solid = new MeshStandardMaterial({roughness: 0.5, emissiveIntensity: 0.35});
    this.ghost = new MeshBasicMaterial({transparent: true, opacity: 0.28, depthTest: false,
                                        depthWrite: false});
    if (turns) this.solid.side = this.ghost.side = DoubleSide;
    this.group = new Group();
    this.group.name = name;
    this.parts = [this.solid, this.ghost].map((material) => {
      const shaft = new Mesh(this.shaftGeometry(width), material);
      const head = new Mesh(new ConeGeometry(2.6 * width, this.headLength, 24), material);
      this.group.add(shaft, head);
      return {shaft, head};
    });
  }

  /** @param {number} width [m] */
  shaftGeometry(width) {
    const {radius, angle} = this.arc;
    return this.turns ? new TubeGeometry(new ArcCurve(radius, angle), kArcSegments, width, 10)
                      : new CylinderGeometry(width, width, 1, 20);
  }

  /** @param {DrivePlace} place @param {number} force @param {number} share of the largest @param {Three} color */
  show({at, axis}, force, share, color) {
    this.group.visible = Number.isFinite(force) && share > 1e-4;
    if (!this.group.visible) return;
    for (const target of [this.solid.color, this.solid.emissive, this.ghost.color]) target.copy(color);
    this.group.position.copy(at);
    this.group.quaternion.setFromUnitVectors(this.turns ? kZ : kY, axis);
    for (const parts of this.parts) {
      if (this.turns) this.curve(parts, share, force >= 0);
      else this.stretch(parts, share * this.size, force >= 0);
    }
  }

  /** @param {Three} parts @param {number} length [m] @param {boolean} push */
  stretch({shaft, head}, length, push) {
    const {headScale, shaftLength, shaftMiddle, headMiddle} = straightArrow(length, this.headLength, push);
    head.scale.setScalar(headScale);
    shaft.scale.set(headScale, shaftLength, headScale);
    shaft.position.set(0, shaftMiddle, 0);
    head.position.set(0, headMiddle, 0);
    head.rotation.set(push ? 0 : Math.PI, 0, 0);
  }

  /** @param {Three} parts @param {number} share @param {boolean} positive */
  curve({shaft, head}, share, positive) {
    const {shown, head: [x, y], headAngle} = bentArrow(share, this.arc, positive);
    shaft.geometry.setDrawRange(0, Math.round(shaft.geometry.index.count * shown));
    shaft.scale.set(1, positive ? 1 : -1, 1);
    head.position.set(x, y, 0);
    head.rotation.set(0, 0, headAngle);
  }
}

/** The massless leg of a distance drive: a rod that slides out of a sleeve. */
export class Leg {
  /** @param {number} radius @param {number} shortest length of the run [m] @param {Three} dark @param {Three} light */
  constructor(radius, shortest, dark, light) {
    this.shortest = shortest;
    this.sleeve = new Mesh(new CylinderGeometry(1.5 * radius, 1.5 * radius, 1, 24), dark);
    this.rod = new Mesh(new CylinderGeometry(radius, radius, 1, 24), light);
    this.ends = [0, 1].map(() => new Mesh(new SphereGeometry(1.7 * radius, 20, 14), dark));
    this.meshes = [this.sleeve, this.rod, ...this.ends];
    for (const mesh of this.meshes) mesh.castShadow = true;
  }

  /** @param {DrivePlace} drive */
  place({from, at, axis}) {
    const {sleeve, rod} = legParts(from.distanceTo(at), this.shortest);
    for (const {mesh, span: [start, end]} of [{mesh: this.sleeve, span: sleeve}, {mesh: this.rod, span: rod}]) {
      mesh.position.copy(from).addScaledVector(axis, (start + end) / 2);
      mesh.scale.set(1, Math.max(1e-6, end - start), 1);
      mesh.quaternion.setFromUnitVectors(kY, axis);
    }
    this.ends[0].position.copy(from);
    this.ends[1].position.copy(at);
  }
}
