// What plots show of their data: values, marks, labels and ranges of axes.

/**
 * NaN is a gap (null); below `floor`, the lower edge of a log axis, values are drawn at it.
 * @param {ArrayLike<number>} values
 * @param {number} [floor]
 */
export const plottable = (values, floor) => Array.from(values, (value) =>
    !Number.isFinite(value) ? null : floor !== undefined && value < floor ? floor : value);

/**
 * At most about `most` samples spread evenly from `first` to `last`. They do not move with the zoom.
 * @param {number} first
 * @param {number} last
 * @param {number} most
 */
export function spread(first, last, most = 48) {
  const step = Math.max(1, Math.floor((last - first) / most));
  const kept = [];
  for (let i = Math.ceil(first / step) * step; i <= last; i += step) kept.push(i);
  return kept;
}

const kRaised = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];

/**
 * "10⁻⁵".
 * @param {number} value
 */
export function powerOfTen(value) {
  const exponent = Math.round(Math.log10(value));
  const digits = [...String(Math.abs(exponent))].map((digit) => kRaised[Number(digit)]);
  return '10' + (exponent < 0 ? '⁻' : '') + digits.join('');
}

/**
 * Labels of linear marks, all with the same k or M; "" for a mark that is left out (null).
 * @param {(number | null)[]} marks
 */
export function axisLabels(marks) {
  const largest = Math.max(...marks.map((mark) => Math.abs(mark ?? 0)));
  const [scale, suffix] = largest >= 1e6 ? [1e-6, ' M'] : largest >= 1e4 ? [1e-3, ' k'] : [1, ''];
  const small = largest > 0 && largest < 1e-3;
  return marks.map((mark) => {
    if (mark === null) return '';
    const text = mark === 0 ? '0' : small ? Number(mark.toPrecision(6)).toExponential() :
                                            String(Number((mark * scale).toPrecision(6)));
    return text.replaceAll('-', '−') + (small ? '' : suffix);
  });
}

/**
 * Room above and below; a constant signal is not blown up to fill the plot.
 * @param {number | null} min null if nothing is finite
 * @param {number | null} max
 * @returns {[number, number]}
 */
export function padded(min, max) {
  if (min === null || max === null) return [0, 1];
  const size = Math.max(Math.abs(min), Math.abs(max));
  const span = Math.max(max - min, 1e-3 * size, 1e-9);
  const middle = (min + max) / 2;
  return [middle - 0.56 * span, middle + 0.56 * span];
}

/**
 * The visible span scaled around a time, inside the run and at least four samples wide.
 * @param {[number, number]} range [s]
 * @param {number} factor
 * @param {number} around [s]; the middle of the span if it is not visible
 * @param {{start: number, end: number, sample: number}} run [s]
 * @returns {[number, number]}
 */
export function zoomed([min, max], factor, around, {start, end, sample}) {
  const span = Math.min(end - start, Math.max(4 * sample, factor * (max - min)));
  const centre = around >= min && around <= max ? around : (min + max) / 2;
  const low = Math.max(start, Math.min(end - span, centre - span * (centre - min) / (max - min)));
  return [low, low + span];
}

/**
 * The largest absolute value of all lines, with its time and the line's key; null if none is finite.
 * @param {{key: string, values: ArrayLike<number>}[]} lines
 * @param {ArrayLike<number>} times [s]
 */
export function largest(lines, times) {
  /** @type {{value: number, time: number, key: string} | null} */
  let found = null;
  for (const {key, values} of lines) {
    for (let i = 0; i < values.length; ++i) {
      const value = Math.abs(values[i]);
      if (value > (found?.value ?? -Infinity)) found = {value, time: times[i], key};
    }
  }
  return found;
}
