// The camera of the replay, turned by mouse, touch and keys.
import {PerspectiveCamera} from 'three';
import {OrbitControls} from 'three/examples/jsm/controls/OrbitControls.js';

const kFieldOfView = 26;  // [deg]
const kLowest = 89;       // from the vertical [deg]
/** @type {Record<string, [number, number]>} */
const kTurns = {ArrowLeft: [-6, 0], ArrowRight: [6, 0], ArrowUp: [0, 6], ArrowDown: [0, -6]};  // [deg]

export class View {
  /**
   * `points` must be in the standard view; `toCamera` is its direction, `up` stands upright in it.
   * @param {HTMLCanvasElement} canvas
   * @param {{up: Three, toCamera: Three, radius: number, points: Three[]}} scene
   * @param {() => void} onChange
   */
  constructor(canvas, {up, toCamera, radius, points}, onChange) {
    this.up = up;
    this.toCamera = toCamera;
    this.points = points;
    this.onChange = onChange;
    this.camera = new PerspectiveCamera(kFieldOfView, 1, 0.01 * radius, 400 * radius);
    this.camera.up.copy(up);
    this.controls = new OrbitControls(this.camera, canvas);
    Object.assign(this.controls, {minDistance: 0.1 * radius, maxDistance: 30 * radius,
                                  maxPolarAngle: kLowest * Math.PI / 180});  // above the ground
    this.controls.addEventListener('change', onChange);
    // The wheel scrolls the page until the replay is in use.
    this.controls.enableZoom = false;
    canvas.addEventListener('pointerdown', () => { this.controls.enableZoom = true; });
    canvas.addEventListener('focus', () => { this.controls.enableZoom = true; });
    canvas.addEventListener('blur', () => { this.controls.enableZoom = false; });
    canvas.addEventListener('keydown', (event) => this.key(event));
    canvas.addEventListener('dblclick', () => this.reset());
  }

  /** @param {number} width @param {number} height [px] */
  resize(width, height) {
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.onChange();
  }

  /** The nearest camera in the standard direction that shows every point. */
  reset() {
    const {toCamera} = this;
    const right = this.up.clone().cross(toCamera).normalize();
    const above = toCamera.clone().cross(right);
    const tanV = Math.tan(kFieldOfView * Math.PI / 360) * 0.92, tanH = tanV * this.camera.aspect;
    const middle = (/** @type {Three} */ axis) => {
      const values = this.points.map((point) => point.dot(axis));
      return (Math.min(...values) + Math.max(...values)) / 2;
    };
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
    this.moved();
  }

  /** @param {KeyboardEvent} event */
  key(event) {
    const turn = kTurns[event.key];
    if (turn) this.orbit(...turn);
    else if (event.key === '+' || event.key === '=') this.dolly(0.9);
    else if (event.key === '-') this.dolly(1 / 0.9);
    else if (event.key.toLowerCase() === 'r') this.reset();
    else return;
    event.preventDefault();
    event.stopPropagation();
  }

  /** @param {number} azimuth @param {number} elevation by which the camera moves [deg] */
  orbit(azimuth, elevation) {
    const offset = this.camera.position.clone().sub(this.controls.target);
    offset.applyAxisAngle(this.up, azimuth * Math.PI / 180);
    const angle = offset.angleTo(this.up) * 180 / Math.PI;
    const wanted = Math.min(kLowest, Math.max(5, angle - elevation));
    const side = this.up.clone().cross(offset).normalize();
    offset.applyAxisAngle(side, (wanted - angle) * Math.PI / 180);
    this.camera.position.copy(this.controls.target).add(offset);
    this.moved();
  }

  /** @param {number} factor of the distance */
  dolly(factor) {
    this.camera.position.sub(this.controls.target).multiplyScalar(factor).add(this.controls.target);
    this.moved();
  }

  moved() {
    this.controls.update();
    this.onChange();
  }
}
