// The data embedded in the page, decoded, and how numbers and drives are shown.

/** Little-endian 32-bit floats from base64. */
export function floats(text) {
  const binary = atob(text);
  const bytes = new Uint8Array(binary.length);
  for (let i = 0; i < binary.length; ++i) bytes[i] = binary.charCodeAt(i);
  const view = new DataView(bytes.buffer);
  const values = new Float32Array(bytes.length / 4);
  for (let i = 0; i < values.length; ++i) values[i] = view.getFloat32(4 * i, true);
  return values;
}

const decode = (signal) => (typeof signal === 'string' ? floats(signal) : null);
const decodeAll = (signals) => signals.map(decode);

/** Signals become Float32Array, or null where a witness has none. */
export function readData() {
  const data = JSON.parse(document.getElementById('page-data').textContent);
  data.time = Float64Array.from(data.time ?? [0]);
  data.witnesses = (data.witnesses ?? []).map((witness) => ({
    ...witness,
    force: decodeAll(witness.force),
    position: decodeAll(witness.position),
    outputs: witness.outputs.map((output) => ({...output, values: decodeAll(output.values)})),
    closure_m: decode(witness.closure_m),
    closure_rad: decode(witness.closure_rad),
    power_input: decode(witness.power_input),
    power_rate: decode(witness.power_rate),
    power_error: decode(witness.power_error),
  }));
  data.pairs = (data.pairs ?? []).map((pair) => ({...pair, error: decodeAll(pair.error)}));
  data.replay.time = Float64Array.from(data.replay.time);
  for (const body of data.replay.bodies) body.poses = decode(body.poses) ?? body.poses;
  return data;
}

/** The witness shown where only one fits: the simulation if it ran. */
export function shownWitness(data) {
  const finite = (witness) => witness.force.some((f) => f && f.some(Number.isFinite));
  const by = (name) => data.witnesses.find((witness) => witness.name === name && finite(witness));
  return by('simulated') ?? by('reference') ?? by('analytic') ?? null;
}

/** Index of the last time at or before t (0 if t lies before all). */
export function indexAt(times, t) {
  let low = 0, high = times.length - 1;
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (times[middle] <= t + 1e-9) low = middle;
    else high = middle - 1;
  }
  return low;
}

/** Index of the nearest time. */
export function nearest(times, t) {
  const i = indexAt(times, t);
  return i + 1 < times.length && times[i + 1] - t < t - times[i] ? i + 1 : i;
}

export function formatError(value) {
  if (!Number.isFinite(value)) return '–';
  return value === 0 ? '0' : value.toExponential(1);
}

/** Four significant digits with k, M where it reads better. */
export function formatValue(value, unit = '') {
  if (!Number.isFinite(value)) return '–';
  const prefixed = ['N', 'W', 'N m', 'J'].includes(unit);
  const size = Math.abs(value);
  let text, prefix = '';
  if (prefixed && size >= 1e6) [text, prefix] = [(value / 1e6).toPrecision(4), 'M'];
  else if (prefixed && size >= 1e3) [text, prefix] = [(value / 1e3).toPrecision(4), 'k'];
  else if (size !== 0 && (size < 1e-3 || size >= 1e6)) text = value.toExponential(2);
  else text = value.toPrecision(4);
  return (text + ' ' + prefix + unit).trim().replaceAll('-', '−');
}

const kLight = ['#1667ad', '#c8471d', '#127a50', '#9a3d78', '#806200', '#0b7f97', '#5f49b8', '#7d4526'];
const kDark = ['#6cb6ff', '#ff9166', '#55cf9a', '#f08cc3', '#e3c04d', '#5fd3ea', '#b9a5ff', '#d9a07c'];

export function isDark() {
  const chosen = document.documentElement.dataset.theme;
  if (chosen === 'light' || chosen === 'dark') return chosen === 'dark';
  return matchMedia('(prefers-color-scheme: dark)').matches;
}

export function driveColor(index) {
  const colors = isDark() ? kDark : kLight;
  return colors[index % colors.length];
}

/** Small helper: element('button', {class: 'x', onclick: f}, child, …). */
export function element(tag, attributes = {}, ...children) {
  const node = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name.startsWith('on')) node.addEventListener(name.slice(2), value);
    else if (value !== null && value !== false) node.setAttribute(name, value === true ? '' : value);
  }
  node.append(...children);
  return node;
}
