// Light and floor of the replay, and the directions that its camera and light come from.
import {AmbientLight, DirectionalLight, GridHelper, HemisphereLight, Vector3} from 'three';

import {gridCells} from './numbers.js';

const kY = new Vector3(0, 1, 0), kZ = new Vector3(0, 0, 1);
const kDegree = Math.PI / 180;

/**
 * A direction above the horizon. Azimuth 0 is the world's x, or z where x is vertical.
 * @param {Three} up
 * @param {number} azimuth [deg]
 * @param {number} elevation [deg]
 */
export function direction(up, azimuth, elevation) {
  const along = Math.abs(up.x) > 0.9 ? kZ.clone() : new Vector3(1, 0, 0);
  along.addScaledVector(up, -along.dot(up)).normalize();
  const left = up.clone().cross(along);
  const [a, e] = [azimuth * kDegree, elevation * kDegree];
  return along.multiplyScalar(Math.cos(e) * Math.cos(a)).addScaledVector(left, Math.cos(e) * Math.sin(a))
      .addScaledVector(up, Math.sin(e));
}

/**
 * Sky and a sun that throws shadows over a sphere.
 * @param {Three} up
 * @param {{centre: Three, radius: number}} sphere
 */
export function lights(up, {centre, radius}) {
  const sky = new HemisphereLight('#ffffff', '#8a8f98', 1.6);
  sky.position.copy(up);
  const sun = new DirectionalLight('#fff6e8', 2.2);
  sun.position.copy(centre).addScaledVector(direction(up, -100, 55), 4 * radius);
  sun.target.position.copy(centre);
  sun.castShadow = true;
  sun.shadow.mapSize.set(1024, 1024);
  Object.assign(sun.shadow.camera, {left: -1.3 * radius, right: 1.3 * radius, top: 1.3 * radius,
                                    bottom: -1.3 * radius, near: 0.1 * radius, far: 9 * radius});
  sun.shadow.normalBias = 0.004 * radius;
  return [sky, sun, sun.target, new AmbientLight('#ffffff', 0.25)];
}

/**
 * A grid a little below the lowest of the points.
 * @param {Three} up
 * @param {{centre: Three, radius: number}} sphere
 * @param {Three[]} points
 */
export function floorGrid(up, {centre, radius}, points) {
  const {cell, count} = gridCells(radius);
  const grid = new GridHelper(count * cell, count, '#8d99a6', '#8d99a6');
  grid.material.transparent = true;
  grid.material.opacity = 0.35;
  grid.quaternion.setFromUnitVectors(kY, up);
  const lowest = Math.min(...points.map((point) => point.dot(up)));
  grid.position.copy(centre).addScaledVector(up, lowest - 0.01 * radius - centre.dot(up));
  return {grid, cell};
}
