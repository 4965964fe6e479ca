// The mechanism in three dimensions, moved by the simulated poses.
import {
  AmbientLight, BoxGeometry, BufferGeometry, CapsuleGeometry, Color, ConeGeometry, Curve,
  CylinderGeometry, DirectionalLight, DoubleSide, Float32BufferAttribute, GridHelper, Group,
  HemisphereLight, Line, LineBasicMaterial, Mesh, MeshBasicMaterial, MeshStandardMaterial,
  PCFShadowMap, PerspectiveCamera, Quaternion, Raycaster, RingGeometry, Scene, SphereGeometry,
  SRGBColorSpace, TubeGeometry, Vector2, Vector3, WebGLRenderer, AxesHelper,
} from 'three';
import {OrbitControls} from 'three/examples/jsm/controls/OrbitControls.js';

import {driveColor, element, formatError, formatValue, indexAt, isDark, nearest, shownWitness} from './data.js';

const kY = new Vector3(0, 1, 0), kZ = new Vector3(0, 0, 1);
const kRamp = ['#3b4cc0', '#2a9d8f', '#e9c46a', '#f4803c', '#c1121f'].map((text) => new Color(text));
const kFieldOfView = 26;

const vector = (numbers) => new Vector3(...numbers);

/** Colour of a share 0 … 1 of the error's range. */
function rampColor(share, target) {
  const at = Math.min(1, Math.max(0, share)) * (kRamp.length - 1);
  const low = Math.min(kRamp.length - 2, Math.floor(at));
  return target.copy(kRamp[low]).lerp(kRamp[low + 1], at - low);
}

class Arc extends Curve {
  constructor(radius, angle) {
    super();
    Object.assign(this, {radius, angle});
  }
  getPoint(t, target = new Vector3()) {
    return target.set(this.radius * Math.cos(t * this.angle), this.radius * Math.sin(t * this.angle), 0);
  }
}

export class Replay {
  constructor(parent, data, timeline) {
    Object.assign(this, {parent, data, timeline, replay: data.replay});
    this.witness = shownWitness(data);
    this.colouring = 'sign';
    this.up = vector(this.replay.up);
    this.renderer = new WebGLRenderer({antialias: true, alpha: true});
    this.renderer.setPixelRatio(Math.min(devicePixelRatio || 1, 2));
    this.renderer.shadowMap.enabled = true;
    this.renderer.shadowMap.type = PCFShadowMap;
    this.scene = new Scene();
    this.materials = new Map();
    this.layout();
    this.addBodies();
    this.measure();
    this.addLights();
    this.addFloor();
    this.addDrives();
    this.addMarks();
    this.addCamera();
    timeline.onChange(() => this.update());
    new ResizeObserver(() => this.resize()).observe(this.stage);
    this.renderer.domElement.addEventListener('webglcontextrestored', () => this.draw());
    this.update();
  }

  layout() {
    const canvas = this.renderer.domElement;
    Object.entries({id: 'scene', tabindex: '0', role: 'img', 'aria-label':
      'Three-dimensional replay of the mechanism. Arrow keys turn it, plus and minus zoom, R resets.'})
        .forEach(([name, value]) => canvas.setAttribute(name, value));
    this.tip = element('div', {class: 'tip', hidden: true});
    this.caption = element('div', {class: 'scene-caption'});
    this.stage = element('div', {class: 'stage'}, canvas, this.tip, this.caption);
    this.side = element('div', {class: 'side'});
    this.parent.replaceChildren(element('div', {class: 'replay'}, this.stage, this.side));
    this.addSide();
  }

  addSide() {
    const colouring = element('select', {id: 'colouring', onchange: () => {
      this.colouring = colouring.value;
      this.update();
    }}, element('option', {value: 'sign'}, 'sign'));
    if (this.errorPair()) colouring.append(element('option', {value: 'error'}, 'error'));
    const check = (text, on, action) => {
      const box = element('input', {type: 'checkbox', checked: on, onchange: () => {
        action(box.checked);
        this.draw();
      }});
      return element('label', {}, box, ' ' + text);
    };
    this.legend = element('p', {class: 'force-legend'});
    this.table = element('tbody');
    this.rows = this.data.drives.map((drive, i) => {
      const cells = ['force', 'error', 'position'].map(() => element('td', {class: 'n'}));
      this.table.append(element('tr', {}, element('th', {scope: 'row'},
          element('i', {class: 'dot', 'data-drive': i}), drive.name), ...cells));
      return cells;
    });
    const head = element('tr');
    for (const title of ['drive', 'force', 'error', 'position']) {
      head.append(element('th', {scope: 'col', class: title === 'drive' ? '' : 'n'}, title));
    }
    this.side.append(
        element('div', {class: 'toolbar'}, element('label', {}, 'Arrows show ', colouring),
                check('closures', true, (on) => { this.marks.visible = on; }),
                check('surroundings', true, (on) => { this.scenery.visible = on; }),
                check('paths', true, (on) => { this.paths.visible = on; }),
                element('button', {type: 'button', onclick: () => this.resetView()}, 'Reset view')),
        this.legend,
        element('div', {class: 'scroll'}, element('table', {class: 'live'},
                element('thead', {}, head), this.table)));
  }

  material(color) {
    if (!this.materials.has(color)) {
      const paint = this.replay.paints[color] ?? this.replay.paints.grey;
      const [r, g, b, a] = paint.rgba;
      const sea = color === 'sea';
      const opacity = sea ? 0.55 * a : a;
      this.materials.set(color, new MeshStandardMaterial({
        color: new Color().setRGB(r, g, b, SRGBColorSpace), roughness: 0.55, metalness: 0.1,
        transparent: opacity < 1, opacity, depthWrite: opacity === 1}));
    }
    return this.materials.get(color);
  }

  addBodies() {
    this.bodies = this.replay.bodies.map((body) => {
      const group = new Group();
      group.name = body.name;
      for (const shape of body.shapes) group.add(this.mesh(shape));
      this.scene.add(group);
      return group;
    });
    // Surroundings move with their bodies but are switched together.
    const all = [];
    this.scene.traverse((node) => node.userData.scenery && all.push(node));
    this.scenery = {set visible(on) { for (const node of all) node.visible = on; }};
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
    mesh.userData.scenery = (this.replay.paints[shape.color] ?? {}).scenery === true;
    mesh.castShadow = !mesh.userData.scenery;
    mesh.receiveShadow = true;
    return mesh;
  }

  rod({type, from, to, radius}, material) {
    const a = vector(from), axis = vector(to).sub(a);
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
    const {time: times, bodies} = this.replay;
    const i = indexAt(times, time);
    const j = Math.min(i + 1, times.length - 1);
    const share = j === i ? 0 : Math.min(1, Math.max(0, (time - times[i]) / (times[j] - times[i])));
    const p = new Vector3(), q = new Quaternion();
    bodies.forEach(({poses}, b) => {
      const at = (frame) => poses.length === 7 ? 0 : 7 * frame;
      const [m, n] = [at(i), at(j)];
      this.bodies[b].position.set(poses[m], poses[m + 1], poses[m + 2])
          .lerp(p.set(poses[n], poses[n + 1], poses[n + 2]), share);
      this.bodies[b].quaternion.set(poses[m + 3], poses[m + 4], poses[m + 5], poses[m + 6])
          .slerp(q.set(poses[n + 3], poses[n + 4], poses[n + 5], poses[n + 6]), share);
      this.bodies[b].updateMatrixWorld(true);
    });
  }

  /** Points of the mechanism over the run: what the camera must show. */
  measure() {
    const points = [];
    const {time} = this.replay;
    for (let k = 0; k <= 8; ++k) {
      this.pose(time[0] + (k / 8) * (time[time.length - 1] - time[0]));
      for (const body of this.bodies) {
        for (const mesh of body.children) {
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
    if (points.length === 0) points.push(new Vector3(-1, -1, -1), new Vector3(1, 1, 1));
    this.points = points;
    const low = points[0].clone(), high = points[0].clone();
    for (const point of points) {
      low.min(point);
      high.max(point);
    }
    this.centre = low.clone().add(high).multiplyScalar(0.5);
    this.radius = Math.max(1e-3, ...points.map((point) => point.distanceTo(this.centre)));
    this.floor = Math.min(...points.map((point) => point.dot(this.up)));
  }

  // Horizontal directions: the world's x (z where x is vertical), and the one left of it.
  horizontal() {
    const along = Math.abs(this.up.x) > 0.9 ? kZ.clone() : new Vector3(1, 0, 0);
    along.addScaledVector(this.up, -along.dot(this.up)).normalize();
    return [along, this.up.clone().cross(along)];
  }

  direction(azimuth, elevation) {
    const [along, left] = this.horizontal();
    const [a, e] = [azimuth * Math.PI / 180, elevation * Math.PI / 180];
    return along.multiplyScalar(Math.cos(e) * Math.cos(a)).addScaledVector(left, Math.cos(e) * Math.sin(a))
        .addScaledVector(this.up, Math.sin(e));
  }

  addLights() {
    const sky = new HemisphereLight('#ffffff', '#8a8f98', 1.6);
    sky.position.copy(this.up);
    const sun = new DirectionalLight('#fff6e8', 2.2);
    sun.position.copy(this.centre).addScaledVector(this.direction(-100, 55), 4 * this.radius);
    sun.target.position.copy(this.centre);
    sun.castShadow = true;
    sun.shadow.mapSize.set(1024, 1024);
    Object.assign(sun.shadow.camera, {left: -1.3 * this.radius, right: 1.3 * this.radius,
                                      top: 1.3 * this.radius, bottom: -1.3 * this.radius,
                                      near: 0.1 * this.radius, far: 9 * this.radius});
    sun.shadow.normalBias = 0.004 * this.radius;
    this.scene.add(sky, sun, sun.target, new AmbientLight('#ffffff', 0.25));
  }

  addFloor() {
    const cell = 10 ** Math.floor(Math.log10(this.radius / 2));
    const size = 2 * Math.ceil(1.6 * this.radius / cell) * cell;
    this.grid = new GridHelper(size, Math.round(size / cell), '#8d99a6', '#8d99a6');
    this.grid.material.transparent = true;
    this.grid.material.opacity = 0.35;
    this.grid.quaternion.setFromUnitVectors(kY, this.up);
    this.grid.position.copy(this.centre)
        .addScaledVector(this.up, this.floor - 0.01 * this.radius - this.centre.dot(this.up));
    const hasScenery = this.replay.bodies.some((body) => body.shapes.some(
        (shape) => this.replay.paints[shape.color]?.scenery));
    this.grid.visible = !hasScenery;
    this.cell = cell;
    this.scene.add(this.grid);
  }

  /** Position and direction of a drive at the current pose: where its force acts. */
  driveAxis(drive, target) {
    const point = (body, p) => vector(p).applyMatrix4(this.bodies[body].matrixWorld);
    if (drive.type === 'distance') {
      target.from = point(drive.from, drive.p_from);
      target.at = point(drive.to, drive.p_to);
      target.axis = target.at.clone().sub(target.from).normalize();
    } else {
      target.at = drive.type === 'slide' ? point(drive.child, drive.p_child) : point(drive.body, drive.p);
      target.axis = vector(drive.axis).applyQuaternion(this.bodies[drive.body].quaternion);
    }
    return target;
  }

  addDrives() {
    const size = 0.32 * this.radius, width = 0.011 * this.radius;
    this.arrows = this.replay.drives.map((drive, index) => {
      const solid = new MeshStandardMaterial({roughness: 0.5, emissiveIntensity: 0.35});
      const ghost = new MeshBasicMaterial({transparent: true, opacity: 0.28, depthTest: false,
                                           depthWrite: false});
      const group = new Group();
      group.name = this.data.drives[index].name;
      const arrow = {drive, group, solid, ghost, size, parts: []};
      for (const material of [solid, ghost]) {
        const parts = drive.type === 'turn' ? this.turnArrow(size, width, material)
                                            : this.straightArrow(width, material);
        group.add(parts.shaft, parts.head);
        arrow.parts.push(parts);
      }
      this.scene.add(group);
      if (drive.type === 'distance') arrow.leg = this.leg(drive, width);
      return arrow;
    });
    this.largest = {};
    this.data.drives.forEach(({unit}, i) => {
      for (const value of this.witness?.force[i] ?? []) {
        if (Number.isFinite(value)) this.largest[unit] = Math.max(this.largest[unit] ?? 0, Math.abs(value));
      }
    });
    this.springs = (this.replay.springs ?? []).map((spring) => {
      const line = new Line(new BufferGeometry(), new LineBasicMaterial({color: '#7a8794'}));
      this.scene.add(line);
      return {spring, line};
    });
  }

  straightArrow(width, material) {
    const shaft = new Mesh(new CylinderGeometry(width, width, 1, 20), material);
    const head = new Mesh(new ConeGeometry(2.6 * width, 6 * width, 24), material);
    return {shaft, head, headLength: 6 * width};
  }

  turnArrow(size, width, material) {
    const radius = 0.4 * size, angle = 1.75 * Math.PI;
    const shaft = new Mesh(new TubeGeometry(new Arc(radius, angle), 64, width, 10), material);
    const head = new Mesh(new ConeGeometry(2.6 * width, 6 * width, 24), material);
    return {shaft, head, radius, angle, count: shaft.geometry.index.count};
  }

  // The massless leg of a distance drive: a rod that slides out of a sleeve.
  leg(drive, width) {
    const radius = drive.radius || 1.1 * width;
    const sleeve = new Mesh(new CylinderGeometry(1.5 * radius, 1.5 * radius, 1, 24), this.material('dark_steel'));
    const rod = new Mesh(new CylinderGeometry(radius, radius, 1, 24), this.material('light_grey'));
    const ends = [0, 1].map(() => new Mesh(new SphereGeometry(1.7 * radius, 20, 14), this.material('dark_steel')));
    const shown = !this.bodies[drive.from].children.some((m) => m.userData.leg);
    for (const mesh of [sleeve, rod, ...ends]) {
      mesh.castShadow = shown;
      this.scene.add(mesh);
    }
    const sleeveLength = 0.55 * this.shortest(drive);
    return {sleeve, rod, ends, sleeveLength};
  }

  shortest(drive) {
    const index = this.replay.drives.indexOf(drive);
    let length = Infinity;
    for (const value of this.witness?.position[index] ?? []) if (value > 0) length = Math.min(length, value);
    return Number.isFinite(length) ? length : 0.5 * this.radius;
  }

  // Rings around the joints that close loops, triads and paths of the outputs.
  addMarks() {
    this.marks = new Group();
    const [r, g, b] = this.replay.paints.closure.rgba;
    const material = new MeshBasicMaterial({color: new Color().setRGB(r, g, b, SRGBColorSpace),
                                            transparent: true, opacity: 0.75, depthTest: false,
                                            side: DoubleSide});
    this.rings = this.replay.closures.map((closure) => {
      const ring = new Mesh(new RingGeometry(0.046 * this.radius, 0.054 * this.radius, 48), material);
      ring.name = `loop closure ${closure.name}`;
      this.marks.add(ring);
      return {closure, ring};
    });
    this.scene.add(this.marks);
    this.paths = new Group();
    for (const [o, output] of this.replay.outputs.entries()) {
      const triad = new AxesHelper(0.16 * this.radius);
      triad.position.set(...output.pose.slice(0, 3));
      triad.quaternion.set(...output.pose.slice(3));
      this.bodies[output.body].add(triad);
      if (output.in_world) this.paths.add(this.path(output, o));
    }
    this.scene.add(this.paths);
  }

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

  addCamera() {
    this.camera = new PerspectiveCamera(kFieldOfView, 1, 0.01 * this.radius, 400 * this.radius);
    this.camera.up.copy(this.up);
    this.controls = new OrbitControls(this.camera, this.renderer.domElement);
    this.controls.addEventListener('change', () => this.draw());
    const canvas = this.renderer.domElement;
    // The wheel scrolls the page until the replay is in use.
    this.controls.enableZoom = false;
    canvas.addEventListener('pointerdown', () => { this.controls.enableZoom = true; });
    canvas.addEventListener('focus', () => { this.controls.enableZoom = true; });
    canvas.addEventListener('blur', () => { this.controls.enableZoom = false; });
    canvas.addEventListener('keydown', (event) => this.key(event));
    canvas.addEventListener('pointermove', (event) => this.point(event));
    canvas.addEventListener('pointerleave', () => { this.tip.hidden = true; });
    canvas.addEventListener('dblclick', () => this.resetView());
    this.resize();
    this.resetView();
  }

  /** The nearest camera in the standard direction that shows every point. */
  resetView() {
    const toCamera = this.direction(-60, 17);
    const right = this.up.clone().cross(toCamera).normalize();
    const above = toCamera.clone().cross(right);
    const tanV = Math.tan(kFieldOfView * Math.PI / 360) * 0.92, tanH = tanV * this.camera.aspect;
    const extent = (axis) => {
      const values = this.points.map((point) => point.dot(axis));
      return [Math.min(...values), Math.max(...values)];
    };
    const middle = (axis) => extent(axis).reduce((a, b) => a + b) / 2;
    const target = right.clone().multiplyScalar(middle(right)).addScaledVector(above, middle(above))
                       .addScaledVector(toCamera, middle(toCamera));
    let distance = 0;
    for (const point of this.points) {
      const p = point.clone().sub(target);
      const z = p.dot(toCamera);
      distance = Math.max(distance, z + Math.abs(p.dot(right)) / tanH, z + Math.abs(p.dot(above)) / tanV);
    }
    this.camera.position.copy(target).addScaledVector(toCamera, distance);
    this.controls.target.copy(target);
    this.controls.minDistance = 0.1 * this.radius;
    this.controls.maxDistance = 30 * this.radius;
    this.controls.update();
    this.draw();
  }

  key(event) {
    const turn = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1]}[event.key];
    if (turn) this.orbit(turn[0] * 6, turn[1] * 6);
    else if (event.key === '+' || event.key === '=') this.dolly(0.9);
    else if (event.key === '-') this.dolly(1 / 0.9);
    else if (event.key.toLowerCase() === 'r') this.resetView();
    else return;
    event.preventDefault();
    event.stopPropagation();
  }

  orbit(azimuth, elevation) {
    const offset = this.camera.position.clone().sub(this.controls.target);
    offset.applyAxisAngle(this.up, azimuth * Math.PI / 180);
    const angle = offset.angleTo(this.up) * 180 / Math.PI;
    const wanted = Math.min(175, Math.max(5, angle - elevation));
    const side = this.up.clone().cross(offset).normalize();
    offset.applyAxisAngle(side, (wanted - angle) * Math.PI / 180);
    this.camera.position.copy(this.controls.target).add(offset);
    this.controls.update();
    this.draw();
  }

  dolly(factor) {
    this.camera.position.sub(this.controls.target).multiplyScalar(factor).add(this.controls.target);
    this.controls.update();
    this.draw();
  }

  // What lies under the pointer.
  point(event) {
    const box = this.renderer.domElement.getBoundingClientRect();
    const at = new Vector2(2 * (event.clientX - box.left) / box.width - 1,
                           1 - 2 * (event.clientY - box.top) / box.height);
    const ray = new Raycaster();
    ray.setFromCamera(at, this.camera);
    const groups = [...this.arrows.map((arrow) => arrow.group), ...this.bodies];
    const hit = event.buttons ? null : ray.intersectObjects(groups, true).find(
        ({object}) => object.isMesh && object.visible && object.parent?.name);
    this.tip.hidden = !hit;
    if (!hit) return;
    const name = hit.object.parent.name;
    const drive = this.arrows.findIndex((arrow) => arrow.group === hit.object.parent);
    this.tip.textContent = drive < 0 ? name : `${name} ${formatValue(this.force(drive), this.data.drives[drive].unit)}`;
    this.tip.style.left = `${Math.min(event.clientX - box.left + 14, box.width - 150)}px`;
    this.tip.style.top = `${event.clientY - box.top + 14}px`;
  }

  sample() {
    return nearest(this.data.time, this.timeline.time);
  }

  force(drive) {
    return this.witness?.force[drive]?.[this.sample()] ?? NaN;
  }

  errorPair() {
    return this.data.pairs.find((pair) => pair.name === 'simulated_vs_analytic' && pair.error.some(Boolean)) ??
           this.data.pairs.find((pair) => pair.error.some(Boolean)) ?? null;
  }

  error(drive) {
    return this.errorPair()?.error[drive]?.[this.sample()] ?? NaN;
  }

  // Decades of the error over the run.
  errorRange() {
    if (!this.range) {
      let low = Infinity, high = 1e-300;
      for (const values of this.errorPair()?.error ?? []) {
        for (const value of values ?? []) {
          if (value > 0) [low, high] = [Math.min(low, value), Math.max(high, value)];
        }
      }
      this.range = [Math.max(low, 1e-6 * high), high];
    }
    return this.range;
  }

  color(drive, force, target) {
    if (this.colouring === 'error') {
      const [low, high] = this.errorRange().map(Math.log10);
      const value = this.error(drive);
      return rampColor(value > 0 ? (Math.log10(value) - low) / (high - low || 1) : 0, target);
    }
    const [r, g, b] = this.replay.paints[force >= 0 ? 'push' : 'pull'].rgba;
    return target.setRGB(r, g, b, SRGBColorSpace);
  }

  update() {
    this.pose(this.timeline.time);
    this.arrows.forEach((arrow, index) => this.placeArrow(arrow, index));
    for (const {closure, ring} of this.rings) {
      ring.position.set(...closure.p_child).applyMatrix4(this.bodies[closure.child].matrixWorld);
    }
    for (const {spring, line} of this.springs) {
      line.geometry.setFromPoints([
        vector(spring.p_from).applyMatrix4(this.bodies[spring.from].matrixWorld),
        vector(spring.p_to).applyMatrix4(this.bodies[spring.to].matrixWorld)]);
    }
    this.fillSide();
    this.draw();
  }

  placeArrow(arrow, index) {
    const place = this.driveAxis(arrow.drive, {});
    if (arrow.leg) this.placeLeg(arrow.leg, place);
    const force = this.force(index);
    const share = Math.abs(force) / (this.largest[this.data.drives[index].unit] || 1);
    arrow.group.visible = Number.isFinite(force) && share > 1e-4;
    if (!arrow.group.visible) return;
    this.color(index, force, arrow.solid.color);
    arrow.solid.emissive.copy(arrow.solid.color);
    arrow.ghost.color.copy(arrow.solid.color);
    arrow.group.position.copy(place.at);
    for (const parts of arrow.parts) {
      if (arrow.drive.type === 'turn') this.bend(parts, share, force);
      else this.stretch(parts, share * arrow.size, force);
    }
    const axis = arrow.drive.type === 'turn' ? kZ : kY;
    arrow.group.quaternion.setFromUnitVectors(axis, place.axis);
  }

  // A push starts at the joint; a pull ends there, so that it stays visible.
  stretch({shaft, head, headLength}, length, force) {
    const headShare = Math.min(1, length / (1.3 * headLength));
    head.scale.setScalar(headShare);
    const h = headLength * headShare, shaftLength = Math.max(1e-9, length - h);
    shaft.scale.set(headShare, shaftLength, headShare);
    shaft.position.set(0, force >= 0 ? shaftLength / 2 : h + shaftLength / 2, 0);
    head.position.set(0, force >= 0 ? shaftLength + h / 2 : h / 2, 0);
    head.rotation.set(force >= 0 ? 0 : Math.PI, 0, 0);
  }

  bend({shaft, head, radius, angle, count}, share, force) {
    const segments = Math.max(1, Math.round(share * 64));
    shaft.geometry.setDrawRange(0, Math.round(count * segments / 64));
    const sign = force >= 0 ? 1 : -1;
    shaft.scale.set(1, sign, 1);
    shaft.material.side = DoubleSide;
    const end = angle * segments / 64;
    head.position.set(radius * Math.cos(end), sign * radius * Math.sin(end), 0);
    head.rotation.set(0, 0, sign > 0 ? end : Math.PI - end);
  }

  placeLeg({sleeve, rod, ends, sleeveLength}, {from, at, axis}) {
    const length = from.distanceTo(at);
    const between = (mesh, start, end) => {
      mesh.position.copy(from).addScaledVector(axis, (start + end) / 2);
      mesh.scale.set(1, Math.max(1e-6, end - start), 1);
      mesh.quaternion.setFromUnitVectors(kY, axis);
    };
    between(sleeve, 0, Math.min(sleeveLength, length));
    between(rod, Math.min(0.9 * sleeveLength, length), length);
    ends[0].position.copy(from);
    ends[1].position.copy(at);
  }

  fillSide() {
    const i = this.sample();
    this.data.drives.forEach((drive, d) => {
      const [force, error, position] = this.rows[d];
      force.textContent = formatValue(this.force(d), drive.unit);
      error.textContent = formatError(this.error(d));
      position.textContent = formatValue(this.witness?.position[d]?.[i] ?? NaN, drive.position_unit);
    });
    this.caption.textContent = this.replay.simulated
        ? `t = ${this.timeline.time.toFixed(3)} s${this.grid.visible ? `, grid ${formatValue(this.cell, 'm').replace(/\.?0+ /, ' ')}` : ''}`
        : 'home pose: there are no simulated poses';
    if (this.legendFor === this.colouring + isDark()) return;
    this.legendFor = this.colouring + isDark();
    for (const dot of this.table.querySelectorAll('.dot')) dot.style.background = driveColor(Number(dot.dataset.drive));
    this.fillLegend();
  }

  fillLegend() {
    const longest = Object.entries(this.largest).map(([unit, value]) => formatValue(value, unit)).join(', ');
    if (this.colouring === 'error') {
      const [low, high] = this.errorRange();
      this.legend.replaceChildren(
          element('span', {}, formatError(low)), element('i', {class: 'ramp'}),
          element('span', {}, `${formatError(high)} of the largest force, `),
          element('span', {}, `${this.errorPair().measured} against ${this.errorPair().truth}`));
    } else {
      this.legend.replaceChildren(
          element('span', {class: 'key push'}, element('i'), 'positive (push)'),
          element('span', {class: 'key pull'}, element('i'), 'negative (pull)'),
          element('span', {class: 'key closure'}, element('i'), 'loop closure'),
          element('span', {class: 'faint'}, longest ? `longest arrow ${longest}` : ''));
    }
  }

  resize() {
    const width = this.stage.clientWidth, height = this.stage.clientHeight;
    if (!width || !height) return;
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.draw();
  }

  // One picture per animation frame at most.
  draw() {
    if (this.pending || !this.camera) return;
    this.pending = true;
    requestAnimationFrame(() => {
      this.pending = false;
      for (const {ring} of this.rings) ring.quaternion.copy(this.camera.quaternion);
      this.renderer.render(this.scene, this.camera);
    });
  }
}
