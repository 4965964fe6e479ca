// What the plots over time show.
import {shownWitness} from './data.js';
import {driveColor} from './dom.js';

/**
 * @typedef {import('./data.js').PageData} PageData
 * @typedef {import('./data.js').Witness} Witness
 *
 * One curve: `key` groups lines for the legend and for switching; `style` is a witness or "solid".
 * @typedef {{key: string, label: string, style: string, color: () => string, values: Float32Array,
 *            dash?: boolean, band?: Band}} Line
 *
 * Where friction at rest leaves a force open: its ends, NaN elsewhere.
 * @typedef {{lower: Float32Array, upper: Float32Array}} Band
 *
 * One plot. `pair`: whose errors it shows; `limit` and `worst` are marked in it.
 * @typedef {{title: string, note?: string, unit: string, log?: boolean, lines: Line[], limit?: number,
 *            pair?: string, worst?: import('./data.js').WorstError}} Panel
 */

const kAxes = ['x', 'y', 'z'], kAngles = ['roll', 'pitch', 'yaw'];
const kDegrees = 180 / Math.PI;

/**
 * @template T
 * @param {T[]} items
 * @param {(item: T) => string} key
 */
export function groupBy(items, key) {
  /** @type {Map<string, T[]>} */
  const groups = new Map();
  for (const item of items) groups.set(key(item), [...(groups.get(key(item)) ?? []), item]);
  return groups;
}

/** @param {string} witness */
export const nameOf = (witness) => witness.replace('_', ' ');

/**
 * The line of one drive, or none without values.
 * @param {import('./data.js').Drive} drive
 * @param {number} index
 * @param {import('./data.js').Signal} values
 * @param {string} [witness] whose line it is, where several are drawn
 * @returns {Line[]}
 */
const driveLine = ({name}, index, values, witness) => values === null ? [] : [
  {key: name, label: witness ?? name, style: witness ?? 'solid', color: () => driveColor(index), values}];

/**
 * All panels with a finite value.
 * @param {PageData} data
 * @returns {Panel[]}
 */
export function makePanels(data) {
  return [...forcePanels(data), ...errorPanels(data), ...positionPanels(data), ...outputPanels(data),
          ...auditPanels(data)]
      .filter((panel) => panel.lines.some(
          (line) => line.values.some(Number.isFinite) || line.band?.lower.some(Number.isFinite)));
}

/** @param {PageData} data */
const indexed = (data) => data.drives.map((drive, index) => ({drive, index}));

/**
 * A force that friction at rest leaves open is not a number there: a gap in its line, with a band.
 * @param {Line} line
 * @param {import('./data.js').Signal | undefined} half width of the band
 * @returns {Line}
 */
export function withBand(line, half) {
  if (!half || !half.some((h) => h > 0)) return line;
  /** @type {(value: (v: number, h: number) => number) => Float32Array} */
  const each = (value) => line.values.map((v, i) => value(v, half[i]));
  return {...line, values: each((v, h) => (h > 0 ? NaN : v)),
          band: {lower: each((v, h) => (h > 0 ? v - h : NaN)), upper: each((v, h) => (h > 0 ? v + h : NaN))}};
}

/**
 * The least and the largest of values and bands.
 * @param {Line[]} lines
 * @param {number | null} min of the values
 * @param {number | null} max
 * @returns {[number | null, number | null]}
 */
export function withBands(lines, min, max) {
  const ends = lines.flatMap(({band}) => (band ? [...band.lower, ...band.upper] : []))
      .filter(Number.isFinite);
  if (ends.length === 0) return [min, max];
  return [ends.reduce((a, b) => Math.min(a, b), min ?? Infinity),
          ends.reduce((a, b) => Math.max(a, b), max ?? -Infinity)];
}

/** @param {PageData} data @returns {Panel[]} */
function forcePanels(data) {
  return [...groupBy(indexed(data), ({drive}) => drive.unit)].map(([unit, group]) => (
      {title: unit === 'N' ? 'Drive forces' : 'Drive torques', unit,
       lines: group.flatMap(({drive, index}) => data.witnesses.flatMap(
           (witness) => driveLine(drive, index, witness.force[index], witness.name)
               .map((line) => withBand(line, witness.band[index]))))}));
}

/** @param {PageData} data @returns {Panel[]} */
function errorPanels(data) {
  return data.pairs.map((pair) => (
      {title: `Force error: ${pair.measured} against ${pair.truth}`, log: true, unit: '',
       note: 'relative to the largest force', limit: pair.limit, pair: pair.name, worst: pair.worst,
       lines: indexed(data).flatMap(({drive, index}) => driveLine(drive, index, pair.error[index]))}));
}

/** @param {PageData} data @returns {Panel[]} */
function positionPanels(data) {
  const witness = shownWitness(data);
  if (!witness) return [];
  return [...groupBy(indexed(data), ({drive}) => drive.position_unit)].map(([unit, group]) => (
      {title: unit === 'm' ? 'Drive positions' : 'Drive angles', note: witness.name, unit,
       lines: group.flatMap(({drive, index}) => driveLine(drive, index, witness.position[index]))}));
}

/** @param {PageData} data @returns {Panel[]} */
function outputPanels(data) {
  return (shownWitness(data)?.outputs ?? []).flatMap((output, o) => {
    /** @type {(names: string[], offset: number, scale: number) => Line[]} */
    const lines = (names, offset, scale) => names.flatMap((name, i) => data.witnesses.flatMap((witness) => {
      const values = witness.outputs[o]?.values[offset + i];
      return values ? [{key: name, label: witness.name, style: witness.name, color: () => driveColor(i),
                        values: values.map((value) => scale * value)}] : [];
    }));
    const note = `in ${output.frame}`;
    return [{title: `Position of ${output.name}`, note, unit: 'm', lines: lines(kAxes, 0, 1)},
            {title: `Orientation of ${output.name}`, note, unit: '°', lines: lines(kAngles, 3, kDegrees)}];
  });
}

/** @param {PageData} data @returns {Panel[]} */
function auditPanels(data) {
  /** @typedef {'closure_m' | 'closure_rad' | 'power_input' | 'power_rate' | 'power_error'} Audit */
  /** @type {(quantity: Audit, label?: string) => Line[]} */
  const of = (quantity, label) => data.witnesses.flatMap((witness, i) => {
    const values = witness[quantity], {name} = witness;
    return values ? [{key: label ? `${name}, ${label}` : name, label: name, style: name, values,
                      color: () => driveColor(i)}] : [];
  });
  const limits = data.witnesses.find((witness) => witness.name === 'simulated')?.limits ?? {};
  const power = [...of('power_input', 'input'),
                 ...of('power_rate', 'energy rate').map((line) => ({...line, dash: true}))];
  return [
    {title: 'Largest loop gap', unit: 'm', log: true, lines: of('closure_m'), limit: limits.closure_m},
    {title: 'Largest loop twist', unit: 'rad', log: true, lines: of('closure_rad'),
     limit: limits.closure_rad},
    {title: 'Power', note: 'input and rate of energy', unit: 'W', lines: power},
    {title: 'Power imbalance', note: '|input − energy rate| / largest power', unit: '', log: true,
     lines: of('power_error'), limit: limits.power_balance},
  ];
}
