// Numbers of the page: decoded, found by time, and as text. Nothing here needs a browser.

/**
 * Little-endian 32-bit floats from base64.
 * @param {string} text
 */
export function floats(text) {
  const binary = atob(text);
  const bytes = new Uint8Array(binary.length);
  for (let i = 0; i < binary.length; ++i) bytes[i] = binary.charCodeAt(i);
  const view = new DataView(bytes.buffer);
  const values = new Float32Array(bytes.length / 4);
  for (let i = 0; i < values.length; ++i) values[i] = view.getFloat32(4 * i, true);
  return values;
}

/**
 * Index of the last time at or before t (0 if t lies before all).
 * @param {ArrayLike<number>} times ascending [s]
 * @param {number} t [s]
 */
export function indexAt(times, t) {
  let low = 0, high = times.length - 1;
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (times[middle] <= t + 1e-9) low = middle;
    else high = middle - 1;
  }
  return low;
}

/**
 * Index of the nearest time.
 * @param {ArrayLike<number>} times ascending [s]
 * @param {number} t [s]
 */
export function nearest(times, t) {
  const i = indexAt(times, t);
  return i + 1 < times.length && times[i + 1] - t < t - times[i] ? i + 1 : i;
}

/**
 * The two samples around t and how far t lies from the first towards the second, 0 … 1.
 * @param {ArrayLike<number>} times ascending [s]
 * @param {number} t [s]
 */
export function between(times, t) {
  const from = indexAt(times, t), to = Math.min(from + 1, times.length - 1);
  const share = to === from ? 0 : (t - times[from]) / (times[to] - times[from]);
  return {from, to, share: Math.min(1, Math.max(0, share))};
}

/**
 * The smallest and the largest error above zero, six decades apart at most.
 * @param {(Iterable<number> | null)[]} errors
 * @returns {[number, number]}
 */
export function errorRange(errors) {
  let low = Infinity, high = 1e-300;
  for (const values of errors) {
    for (const value of values ?? []) {
      if (value > 0) [low, high] = [Math.min(low, value), Math.max(high, value)];
    }
  }
  return [Math.max(low, 1e-6 * high), high];
}

/**
 * Where a value lies between the two ends of a logarithmic range: 0 at the lower one.
 * @param {number} value
 * @param {[number, number]} range
 */
export function logShare(value, range) {
  const [low, high] = range.map(Math.log10);
  return value > 0 ? (Math.log10(value) - low) / (high - low || 1) : 0;
}

/**
 * Where a share 0 … 1 lies among `count` stops: the stop below it and the rest of the way to the next.
 * @param {number} share
 * @param {number} count
 */
export function rampPlace(share, count) {
  const at = Math.min(1, Math.max(0, share)) * (count - 1);
  const stop = Math.min(count - 2, Math.floor(at));
  return {stop, rest: at - stop};
}

/** @param {number} value */
export function formatError(value) {
  if (!Number.isFinite(value)) return '–';
  return value === 0 ? '0' : value.toExponential(1);
}

/** Of the largest value around: what is smaller is round-off, and shown as 0. */
export const kResolution = 1e-12;

/**
 * Four significant digits with k, M where it reads better.
 * @param {number} value
 * @param {string} unit
 * @param {number} largest of the values around, for round-off
 */
export function formatValue(value, unit = '', largest = 0) {
  if (!Number.isFinite(value)) return '–';
  if (Math.abs(value) < kResolution * largest) return `0 ${unit}`.trim();
  const prefixed = ['N', 'W', 'N m', 'J'].includes(unit);
  const size = Math.abs(value);
  let text, prefix = '';
  if (prefixed && size >= 1e6) [text, prefix] = [(value / 1e6).toPrecision(4), 'M'];
  else if (prefixed && size >= 1e3) [text, prefix] = [(value / 1e3).toPrecision(4), 'k'];
  else if (size !== 0 && (size < 1e-3 || size >= 1e6)) text = value.toExponential(2);
  else text = value.toPrecision(4);
  return (text + ' ' + prefix + unit).trim().replaceAll('-', '−');
}

/**
 * A force, or both ends of the band that friction at rest leaves it.
 * @param {number} force the middle of the band
 * @param {number} half its half-width, 0 where the force is a number
 * @param {string} unit
 */
export function formatForce(force, half, unit) {
  if (!(half > 0)) return formatValue(force, unit);
  return `${formatValue(force - half, unit)} … ${formatValue(force + half, unit)}`;
}

/**
 * The largest absolute value of each unit.
 * @param {{unit: string}[]} drives
 * @param {(Iterable<number> | null)[]} forces by drive
 */
export function largestByUnit(drives, forces) {
  /** @type {Record<string, number>} */
  const largest = {};
  drives.forEach(({unit}, i) => {
    for (const value of forces[i] ?? []) {
      if (Number.isFinite(value)) largest[unit] = Math.max(largest[unit] ?? 0, Math.abs(value));
    }
  });
  return largest;
}

/**
 * The smallest value above zero, or Infinity.
 * @param {Iterable<number>} values
 */
export function smallestPositive(values) {
  let smallest = Infinity;
  for (const value of values) if (value > 0) smallest = Math.min(smallest, value);
  return smallest;
}

/**
 * The cell of a grid below something of this radius: a power of ten [m], and how many fit beside it.
 * @param {number} radius [m]
 */
export function gridCells(radius) {
  const cell = 10 ** Math.floor(Math.log10(radius / 2));
  return {cell, count: 2 * Math.ceil(1.6 * radius / cell)};
}
