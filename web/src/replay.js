// The mechanism in three dimensions, moved by the simulated poses.
import {
  AmbientLight, AxesHelper, BufferGeometry, Color, DirectionalLight, DoubleSide,
  Float32BufferAttribute, GridHelper, Group, HemisphereLight, Line, LineBasicMaterial, Mesh,
  MeshBasicMaterial, PCFShadowMap, Quaternion, Raycaster, RingGeometry, Scene, SRGBColorSpace,
  Vector2, Vector3, WebGLRenderer,
} from 'three';

import {Arrow, Leg} from './arrows.js';
import {Bodies} from './bodies.js';
import {driveColor, element, formatError, formatValue, isDark, nearest, shownWitness} from './data.js';
import {View} from './view.js';

const kY = new Vector3(0, 1, 0), kZ = new Vector3(0, 0, 1);
const kRamp = ['#3b4cc0', '#2a9d8f', '#e9c46a', '#f4803c', '#c1121f'].map((text) => new Color(text));

const vector = (numbers) => new Vector3(...numbers);

/** Colour of a share 0 … 1 of the error's range. */
function rampColor(share, target) {
  const at = Math.min(1, Math.max(0, share)) * (kRamp.length - 1);
  const low = Math.min(kRamp.length - 2, Math.floor(at));
  return target.copy(kRamp[low]).lerp(kRamp[low + 1], at - low);
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
    this.layout();
    this.bodies = new Bodies(this.replay);
    this.scene.add(...this.bodies.groups);
    this.measure();
    this.addLights();
    this.addFloor();
    this.addDrives();
    this.addMarks();
    this.addView();
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
                check('surroundings', true, (on) => this.bodies.showScenery(on)),
                check('paths', true, (on) => { this.paths.visible = on; }),
                element('button', {type: 'button', onclick: () => this.view.reset()}, 'Reset view')),
        this.legend,
        element('div', {class: 'scroll'}, element('table', {class: 'live'},
                element('thead', {}, head), this.table)));
  }

  // Where the mechanism is and how large; what the camera must show.
  measure() {
    this.points = this.bodies.points();
    const low = this.points[0].clone(), high = this.points[0].clone();
    for (const point of this.points) {
      low.min(point);
      high.max(point);
    }
    this.centre = low.clone().add(high).multiplyScalar(0.5);
    this.radius = Math.max(1e-3, ...this.points.map((point) => point.distanceTo(this.centre)));
    this.floor = Math.min(...this.points.map((point) => point.dot(this.up)));
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
    const point = (body, p) => vector(p).applyMatrix4(this.bodies.groups[body].matrixWorld);
    if (drive.type === 'distance') {
      target.from = point(drive.from, drive.p_from);
      target.at = point(drive.to, drive.p_to);
      target.axis = target.at.clone().sub(target.from).normalize();
    } else {
      target.at = drive.type === 'slide' ? point(drive.child, drive.p_child) : point(drive.body, drive.p);
      target.axis = vector(drive.axis).applyQuaternion(this.bodies.groups[drive.body].quaternion);
    }
    return target;
  }

  addDrives() {
    const width = 0.011 * this.radius;
    this.arrows = this.replay.drives.map((drive, index) => {
      const arrow = new Arrow(drive.type === 'turn', this.data.drives[index].name, 0.32 * this.radius, width);
      this.scene.add(arrow.group);
      return arrow;
    });
    this.legs = this.replay.drives.map((drive) => {
      if (drive.type !== 'distance') return null;
      const leg = new Leg(drive.radius || 1.1 * width, this.shortest(drive), this.bodies.material('dark_steel'),
                          this.bodies.material('light_grey'));
      this.scene.add(...leg.meshes);
      return leg;
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
      this.bodies.groups[output.body].add(triad);
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

  addView() {
    const canvas = this.renderer.domElement;
    this.view = new View(canvas, {
      up: this.up, toCamera: this.direction(-60, 17), radius: this.radius, points: this.points,
    }, () => this.draw());
    canvas.addEventListener('pointermove', (event) => this.point(event));
    canvas.addEventListener('pointerleave', () => { this.tip.hidden = true; });
    this.resize();
    this.view.reset();
  }

  // What lies under the pointer.
  point(event) {
    const box = this.renderer.domElement.getBoundingClientRect();
    const at = new Vector2(2 * (event.clientX - box.left) / box.width - 1,
                           1 - 2 * (event.clientY - box.top) / box.height);
    const ray = new Raycaster();
    ray.setFromCamera(at, this.view.camera);
    const groups = [...this.arrows.map((arrow) => arrow.group), ...this.bodies.groups];
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
    this.bodies.pose(this.timeline.time);
    this.replay.drives.forEach((drive, index) => this.placeDrive(drive, index));
    for (const {closure, ring} of this.rings) {
      ring.position.set(...closure.p_child).applyMatrix4(this.bodies.groups[closure.child].matrixWorld);
    }
    for (const {spring, line} of this.springs) {
      line.geometry.setFromPoints([
        vector(spring.p_from).applyMatrix4(this.bodies.groups[spring.from].matrixWorld),
        vector(spring.p_to).applyMatrix4(this.bodies.groups[spring.to].matrixWorld)]);
    }
    this.fillSide();
    this.draw();
  }

  placeDrive(drive, index) {
    const place = this.driveAxis(drive, {});
    this.legs[index]?.place(place);
    const force = this.force(index);
    const share = Math.abs(force) / (this.largest[this.data.drives[index].unit] || 1);
    this.arrows[index].show(place, force, share, this.color(index, force, new Color()));
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
    if (!width || !height || !this.view) return;
    this.renderer.setSize(width, height, false);
    this.view.resize(width, height);
  }

  // One picture per animation frame at most.
  draw() {
    if (this.pending || !this.view) return;
    this.pending = true;
    requestAnimationFrame(() => {
      this.pending = false;
      for (const {ring} of this.rings) ring.quaternion.copy(this.view.camera.quaternion);
      this.renderer.render(this.scene, this.view.camera);
    });
  }
}
