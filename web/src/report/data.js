// The data embedded in the page (src/report/html_data.cc, html_replay.cc).
import {floats} from './numbers.js';

/**
 * Samples of a signal; null where a witness has none.
 * @typedef {Float32Array | null} Signal
 *
 * @typedef {{name: string, unit: string, position_unit: string}} Drive
 *
 * Place [m] and angles [rad] of an output in a frame.
 * @typedef {{name: string, frame: string, values: Signal[]}} OutputSignals
 *
 * `force`, half-width of its `band` and `position` by drive; `limits` by check.
 * @typedef {{name: string, force: Signal[], band: Signal[], position: Signal[], outputs: OutputSignals[],
 *            closure_m: Signal, closure_rad: Signal, power_input: Signal, power_rate: Signal,
 *            power_error: Signal, limits: Record<string, number>}} Witness
 *
 * The sample with the largest error: index of the drive, time [s].
 * @typedef {{drive: number, time: number, value: number}} WorstError
 *
 * Force errors of one witness against another, by drive, relative to the largest force.
 * @typedef {{name: string, measured: string, truth: string, error: Signal[], limit?: number,
 *            worst?: WorstError}} Pair
 *
 * Poses (x, y, z and quaternion x, y, z, w) of a body: seven numbers at rest, else seven per frame.
 * @typedef {{name: string, shapes: any[], poses: ArrayLike<number>}} Body
 *
 * @typedef {{rgba: number[], scenery: boolean}} Paint
 *
 * A decimated mesh: three coordinates per vertex [m], three vertices per triangle.
 * @typedef {{vertices: Float32Array, triangles: Uint32Array}} Surface
 *
 * Bodies are named by their index.
 * @typedef {{up: number[], time: Float64Array, bodies: Body[], paints: Record<string, Paint>,
 *            surfaces?: Surface[], drives: any[], closures: any[], springs?: any[], outputs: any[],
 *            simulated: boolean}} ReplayData
 *
 * @typedef {{time: Float64Array, drives: Drive[], witnesses: Witness[], pairs: Pair[],
 *            replay: ReplayData}} PageData
 */

/** @param {unknown} signal @returns {Signal} */
const decode = (signal) => (typeof signal === 'string' ? floats(signal) : null);
/** @param {unknown[]} signals */
const decodeAll = (signals) => signals.map(decode);

/**
 * Signals become Float32Array, or null where a witness has none.
 * @param {string} json
 * @returns {PageData}
 */
export function readData(json) {
  const data = JSON.parse(json);
  data.time = Float64Array.from(data.time ?? [0]);
  data.witnesses = (data.witnesses ?? []).map((/** @type {any} */ witness) => ({
    ...witness,
    force: decodeAll(witness.force),
    band: decodeAll(witness.band ?? []),
    position: decodeAll(witness.position),
    outputs: witness.outputs.map((/** @type {any} */ output) => (
        {...output, values: decodeAll(output.values)})),
    closure_m: decode(witness.closure_m),
    closure_rad: decode(witness.closure_rad),
    power_input: decode(witness.power_input),
    power_rate: decode(witness.power_rate),
    power_error: decode(witness.power_error),
  }));
  data.pairs = (data.pairs ?? []).map((/** @type {any} */ pair) => (
      {...pair, error: decodeAll(pair.error)}));
  data.replay.time = Float64Array.from(data.replay.time);
  data.replay.surfaces = data.replay.surfaces?.map((/** @type {any} */ surface) => (
      {vertices: floats(surface.vertices), triangles: Uint32Array.from(floats(surface.triangles))}));
  for (const body of data.replay.bodies) body.poses = decode(body.poses) ?? body.poses;
  return data;
}

/**
 * The witness shown where only one fits: the simulation if it ran.
 * @param {PageData} data
 */
export function shownWitness(data) {
  const finite = (/** @type {Witness} */ witness) => witness.force.some((f) => f && f.some(Number.isFinite));
  const by = (/** @type {string} */ name) =>
      data.witnesses.find((witness) => witness.name === name && finite(witness));
  return by('simulated') ?? by('reference') ?? by('analytic') ?? null;
}

/**
 * The pair whose errors colour the replay.
 * @param {PageData} data
 */
export function errorPair({pairs}) {
  const known = pairs.filter((pair) => pair.error.some(Boolean));
  return known.find((pair) => pair.name === 'simulated_vs_analytic') ?? known[0] ?? null;
}

/**
 * Times of the largest errors, the largest first, each once, with what was worst there.
 * @param {PageData} data
 */
export function worstSamples({pairs, drives}) {
  return pairs.flatMap(({measured, truth, worst}) => worst && Number.isFinite(worst.time)
                           ? [{time: worst.time, value: worst.value,
                               label: `${measured} against ${truth}: ${drives[worst.drive].name}`}]
                           : [])
      .sort((a, b) => b.value - a.value)
      .filter((worst, i, all) => all.findIndex(({time}) => time === worst.time) === i);
}
