// Range and marks of a logarithmic axis.

const kDecades = 16;    // shown at most
const kLowest = 1e-20;  // values below are drawn here: far under any round-off, and safe for plotting

/**
 * The decades [low, high] that hold the values and the limit; null if no value is above zero.
 * @param {{values: Iterable<number>}[]} lines
 * @param {number | null} limit
 * @returns {[number, number] | null}
 */
export function decades(lines, limit = null) {
  let low = Infinity, high = 0;
  for (const line of lines) {
    for (const value of line.values) {
      if (!(value > 0) || !Number.isFinite(value)) continue;
      low = Math.min(low, value);
      high = Math.max(high, value);
    }
  }
  if (high === 0) return null;
  const exponent = (/** @type {number} */ value) => Math.log10(Math.max(value, kLowest));
  const top = Math.ceil(exponent(Math.max(high, limit ?? 0)) + 0.2);
  const bottom = Math.floor(exponent(Math.min(low, limit ?? low)));
  return [10 ** Math.max(bottom, top - kDecades), 10 ** top];
}

/**
 * Whole decades between low and high, at most `most` of them, evenly spaced.
 * @param {number} low
 * @param {number} high
 * @param {number} most
 */
export function decadeMarks(low, high, most = 8) {
  const first = Math.ceil(Math.log10(low) - 1e-9), last = Math.floor(Math.log10(high) + 1e-9);
  const step = Math.max(1, Math.ceil((last - first) / most));
  const marks = [];
  for (let e = first; e <= last; e += step) marks.push(10 ** e);
  return marks;
}
