// Where the parts of a drive's arrow and leg lie.

/**
 * A straight arrow of a length [m] along +y: a push starts at 0; a pull ends there, so that it stays
 * visible. An arrow shorter than its head is a smaller head.
 * @param {number} length [m]
 * @param {number} headLength of a head that is not made smaller [m]
 * @param {boolean} push
 */
export function straightArrow(length, headLength, push) {
  const headScale = Math.min(1, length / (1.3 * headLength));
  const head = headLength * headScale, shaft = Math.max(1e-9, length - head);
  return {headScale, shaftLength: shaft, shaftMiddle: push ? shaft / 2 : head + shaft / 2,
          headMiddle: push ? shaft + head / 2 : head / 2};
}

/**
 * A curved arrow: a share of an arc about z that starts on +x, made of whole segments, at least one.
 * @param {number} share 0 … 1
 * @param {{radius: number, angle: number, segments: number}} arc the whole one [m, rad]
 * @param {boolean} positive turns about +z
 */
export function bentArrow(share, {radius, angle, segments}, positive) {
  const shown = Math.max(1, Math.round(share * segments)) / segments;
  const end = angle * shown, sign = positive ? 1 : -1;
  return {shown, head: [radius * Math.cos(end), sign * radius * Math.sin(end)],
          headAngle: positive ? end : Math.PI - end};
}

/**
 * Sleeve and rod of a leg as [start, end] along it [m]: the rod slides out of the sleeve.
 * @param {number} length [m]
 * @param {number} shortest the shortest length of the run [m]
 */
export function legParts(length, shortest) {
  const sleeve = 0.55 * shortest;
  return {sleeve: [0, Math.min(sleeve, length)], rod: [Math.min(0.9 * sleeve, length), length]};
}
