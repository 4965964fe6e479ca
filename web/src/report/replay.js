// The mechanism in three dimensions, moved by the simulated poses.
import {
  AxesHelper, BufferGeometry, Color, DoubleSide, Float32BufferAttribute, Group, Line,
  LineBasicMaterial, Mesh, MeshBasicMaterial, PCFShadowMap, Quaternion, Raycaster, RingGeometry,
  Scene, SRGBColorSpace, Vector2, Vector3, WebGLRenderer,
} from 'three';

import {Arrow, Leg} from './arrows.js';
import {Bodies} from './bodies.js';
import {errorPair, shownWitness} from './data.js';
import {driveColor, element} from './dom.js';
import {
  errorRange, formatForce, formatValue, largestByUnit, logShare, nearest, rampPlace, smallestPositive,
} from './numbers.js';
import {ReplaySide} from './replay_side.js';
import {direction, floorGrid, lights} from './surroundings.js';
import {View} from './view.js';

const kRamp = ['#3b4cc0', '#2a9d8f', '#e9c46a', '#f4803c', '#c1121f'].map((text) => new Color(text));
const kCanvas = {id: 'scene', tabindex: '0', role: 'img', 'aria-label':
  'Three-dimensional replay of the mechanism. Arrow keys turn it, plus and minus zoom, R resets.'};

const vector = (/** @type {number[]} */ numbers) => new Vector3(...numbers);

/**
 * Colour of a share 0 … 1 of the error's range.
 * @param {number} share
 * @param {Three} target
 */
function rampColor(share, target) {
  const {stop, rest} = rampPlace(share, kRamp.length);
  return target.copy(kRamp[stop]).lerp(kRamp[stop + 1], rest);
}

function makeRenderer() {
  const renderer = new WebGLRenderer({antialias: true, alpha: true});
  renderer.setPixelRatio(Math.min(devicePixelRatio || 1, 2));
  renderer.shadowMap.enabled = true;
  renderer.shadowMap.type = PCFShadowMap;
  for (const [name, value] of Object.entries(kCanvas)) renderer.domElement.setAttribute(name, value);
  return renderer;
}

/**
 * Around the middle of a box that holds all points.
 * @param {Three[]} points
 */
function sphereAround(points) {
  const low = points[0].clone(), high = points[0].clone();
  for (const point of points) {
    low.min(point);
    high.max(point);
  }
  const centre = low.clone().add(high).multiplyScalar(0.5);
  return {centre, radius: Math.max(1e-3, ...points.map((point) => point.distanceTo(centre)))};
}

export class Replay {
  /**
   * @param {HTMLElement} parent
   * @param {import('./data.js').PageData} data
   * @param {import('./timeline.js').Timeline} timeline
   */
  constructor(parent, data, timeline) {
    this.data = data;
    this.timeline = timeline;
    this.replay = data.replay;
    this.witness = shownWitness(data);
    this.errors = errorPair(data);
    this.range = errorRange(this.errors?.error ?? []);
    this.largest = largestByUnit(data.drives, this.witness?.force ?? []);
    this.renderer = makeRenderer();
    this.tip = element('div', {class: 'tip', hidden: true});
    this.caption = element('div', {class: 'scene-caption'});
    this.stage = element('div', {class: 'stage'}, this.renderer.domElement, this.tip, this.caption);
    this.side = this.makeSide();
    parent.replaceChildren(element('div', {class: 'replay'}, this.stage, this.side.node));

    this.scene = new Scene();
    this.bodies = new Bodies(this.replay);
    this.scene.add(...this.bodies.groups);
    const points = this.bodies.points(), up = vector(this.replay.up), sphere = sphereAround(points);
    this.radius = sphere.radius;
    this.floor = floorGrid(up, sphere, points);
    this.floor.grid.visible = !this.bodies.hasScenery();
    this.scene.add(...lights(up, sphere), this.floor.grid);
    this.arrows = this.addArrows();
    this.legs = this.addLegs();
    this.springs = this.addSprings();
    this.marks = new Group();  // what shows how loops are closed
    this.rings = this.addRings();
    this.paths = this.addPaths();
    this.scene.add(this.marks, this.paths);

    this.pending = false;  // a picture is asked for
    this.view = new View(this.renderer.domElement,
                         {up, toCamera: direction(up, -60, 17), radius: this.radius, points},
                         () => this.draw());
    this.resize();
    this.view.reset();
    this.listen();
    this.update();
  }

  makeSide() {
    /** @type {(action: (on: boolean) => void) => (on: boolean) => void} */
    const drawn = (action) => (on) => {
      action(on);
      this.draw();
    };
    return new ReplaySide(
        this.data.drives, this.errors, {colour: () => this.update(), reset: () => this.view.reset()},
        {closures: drawn((on) => { this.marks.visible = on; }),
         surroundings: drawn((on) => this.bodies.showScenery(on)),
         paths: drawn((on) => { this.paths.visible = on; })});
  }

  listen() {
    const canvas = this.renderer.domElement;
    canvas.addEventListener('pointermove', (/** @type {PointerEvent} */ event) => this.point(event));
    canvas.addEventListener('pointerleave', () => { this.tip.hidden = true; });
    canvas.addEventListener('webglcontextrestored', () => this.draw());
    new ResizeObserver(() => this.resize()).observe(this.stage);
    this.timeline.onChange(() => this.update());
  }

  addArrows() {
    return this.replay.drives.map((drive, index) => {
      const arrow = new Arrow(drive.type === 'turn', this.data.drives[index].name, 0.32 * this.radius,
                              0.011 * this.radius);
      this.scene.add(arrow.group);
      return arrow;
    });
  }

  addLegs() {
    return this.replay.drives.map((drive, index) => {
      if (drive.type !== 'distance') return null;
      const shortest = smallestPositive(this.witness?.position[index] ?? []);
      const leg = new Leg(drive.radius || 0.0121 * this.radius,
                          Number.isFinite(shortest) ? shortest : 0.5 * this.radius,
                          this.bodies.material('dark_steel'), this.bodies.material('light_grey'));
      this.scene.add(...leg.meshes);
      return leg;
    });
  }

  addSprings() {
    return (this.replay.springs ?? []).map((spring) => {
      const line = new Line(new BufferGeometry(), new LineBasicMaterial({color: '#7a8794'}));
      this.scene.add(line);
      return {spring, line};
    });
  }

  // Rings around the joints that close loops.
  addRings() {
    const [r, g, b] = this.replay.paints.closure.rgba;
    const material = new MeshBasicMaterial({color: new Color().setRGB(r, g, b, SRGBColorSpace),
                                            transparent: true, opacity: 0.75, depthTest: false,
                                            side: DoubleSide});
    return this.replay.closures.map((closure) => {
      const ring = new Mesh(new RingGeometry(0.046 * this.radius, 0.054 * this.radius, 48), material);
      ring.name = `loop closure ${closure.name}`;
      this.marks.add(ring);
      return {closure, ring};
    });
  }

  // Triads and paths of the outputs.
  addPaths() {
    const paths = new Group();
    this.replay.outputs.forEach((output, index) => {
      const triad = new AxesHelper(0.16 * this.radius);
      triad.position.set(...output.pose.slice(0, 3));
      triad.quaternion.set(...output.pose.slice(3));
      this.bodies.groups[output.body].add(triad);
      if (output.in_world) paths.add(this.path(output, index));
    });
    return paths;
  }

  /** @param {{body: number, pose: number[]}} output @param {number} index */
  path(output, index) {
    const poses = this.replay.bodies[output.body].poses;
    const points = [], q = new Quaternion();
    for (let at = 0; at < poses.length; at += 7) {
      const p = vector(output.pose.slice(0, 3))
                    .applyQuaternion(q.set(poses[at + 3], poses[at + 4], poses[at + 5], poses[at + 6]));
      points.push(p.x + poses[at], p.y + poses[at + 1], p.z + poses[at + 2]);
    }
    const geometry = new BufferGeometry();
    geometry.setAttribute('position', new Float32BufferAttribute(points, 3));
    return new Line(geometry, new LineBasicMaterial({color: driveColor(index), depthTest: false}));
  }

  /**
   * Names what lies under the pointer.
   * @param {PointerEvent} event
   */
  point(event) {
    const box = this.renderer.domElement.getBoundingClientRect();
    const at = new Vector2(2 * (event.clientX - box.left) / box.width - 1,
                           1 - 2 * (event.clientY - box.top) / box.height);
    const ray = new Raycaster();
    ray.setFromCamera(at, this.view.camera);
    const groups = [...this.arrows.map((arrow) => arrow.group), ...this.bodies.groups];
    const hit = event.buttons ? null : ray.intersectObjects(groups, true).find(
        (/** @type {Three} */ {object}) => object.isMesh && object.visible && object.parent?.name);
    this.tip.hidden = !hit;
    if (!hit) return;
    const name = hit.object.parent.name;
    const drive = this.arrows.findIndex((arrow) => arrow.group === hit.object.parent);
    this.tip.textContent = drive < 0 ? name : `${name} ${formatForce(this.force(drive), this.half(drive), this.data.drives[drive].unit)}`;
    this.tip.style.left = `${Math.min(event.clientX - box.left + 14, box.width - 150)}px`;
    this.tip.style.top = `${event.clientY - box.top + 14}px`;
  }

  sample() {
    return nearest(this.data.time, this.timeline.time);
  }

  /** @param {number} drive */
  force(drive) {
    return this.witness?.force[drive]?.[this.sample()] ?? NaN;
  }

  /**
   * Of the band that friction at rest leaves the force.
   * @param {number} drive
   */
  half(drive) {
    return this.witness?.band[drive]?.[this.sample()] ?? 0;
  }

  /** @param {number} drive */
  error(drive) {
    return this.errors?.error[drive]?.[this.sample()] ?? NaN;
  }

  /** @param {number} drive @param {number} force */
  color(drive, force) {
    const color = new Color();
    if (this.side.showsError()) return rampColor(logShare(this.error(drive), this.range), color);
    const [r, g, b] = this.replay.paints[force >= 0 ? 'push' : 'pull'].rgba;
    return color.setRGB(r, g, b, SRGBColorSpace);
  }

  update() {
    this.bodies.pose(this.timeline.time);
    this.replay.drives.forEach((drive, index) => this.placeDrive(drive, index));
    for (const {closure, ring} of this.rings) {
      ring.position.copy(this.bodies.inWorld(closure.child, vector(closure.p_child)));
    }
    for (const {spring, line} of this.springs) {
      line.geometry.setFromPoints([this.bodies.inWorld(spring.from, vector(spring.p_from)),
                                   this.bodies.inWorld(spring.to, vector(spring.p_to))]);
    }
    this.side.fill(this.data.drives.map((_drive, i) => (
        {force: this.force(i), half: this.half(i), error: this.error(i),
         position: this.witness?.position[i]?.[this.sample()] ?? NaN})));
    this.side.fillLegend(this.range, this.largest);
    this.caption.textContent = this.captionText();
    this.draw();
  }

  captionText() {
    if (!this.replay.simulated) return 'home pose: there are no simulated poses';
    const cell = formatValue(this.floor.cell, 'm').replace(/\.?0+ /, ' ');
    return `t = ${this.timeline.time.toFixed(3)} s` + (this.floor.grid.visible ? `, grid ${cell}` : '');
  }

  /** @param {any} drive of the replay's data @param {number} index */
  placeDrive(drive, index) {
    const place = this.driveAxis(drive);
    this.legs[index]?.place(place);
    const force = this.force(index);
    const share = Math.abs(force) / (this.largest[this.data.drives[index].unit] || 1);
    this.arrows[index].show(place, force, share, this.color(index, force));
  }

  /**
   * Where a drive is at the current pose.
   * @param {any} drive of the replay's data
   * @returns {import('./arrows.js').DrivePlace}
   */
  driveAxis(drive) {
    const point = (/** @type {number} */ body, /** @type {number[]} */ p) => this.bodies.inWorld(body, vector(p));
    if (drive.type === 'distance') {
      const from = point(drive.from, drive.p_from), at = point(drive.to, drive.p_to);
      return {from, at, axis: at.clone().sub(from).normalize()};
    }
    const at = drive.type === 'slide' ? point(drive.child, drive.p_child) : point(drive.body, drive.p);
    return {from: at, at, axis: vector(drive.axis).applyQuaternion(this.bodies.groups[drive.body].quaternion)};
  }

  resize() {
    const width = this.stage.clientWidth, height = this.stage.clientHeight;
    if (!width || !height) return;
    this.renderer.setSize(width, height, false);
    this.view.resize(width, height);
  }

  // One picture per animation frame at most.
  draw() {
    if (this.pending) return;
    this.pending = true;
    requestAnimationFrame(() => {
      this.pending = false;
      for (const {ring} of this.rings) ring.quaternion.copy(this.view.camera.quaternion);
      this.renderer.render(this.scene, this.view.camera);
    });
  }
}
