// The data of report.html, and what is plotted of it, without a browser.
import assert from 'node:assert/strict';
import {test} from 'node:test';

import {errorPair, readData, shownWitness, worstSamples} from '../../web/src/report/data.js';
import {groupBy, makePanels, withBands} from '../../web/src/report/panels.js';

function base64(...values) {
  const bytes = Buffer.alloc(4 * values.length);
  values.forEach((value, i) => bytes.writeFloatLE(value, 4 * i));
  return bytes.toString('base64');
}

const witness = (name, more = {}) => (
    {name, force: [base64(1, 2), base64(3, 4)], position: [base64(5, 6), null],
     outputs: [{name: 'tool', frame: 'world', values: Array(6).fill(base64(0, 1))}],
     closure_m: null, closure_rad: null, power_input: null, power_rate: null, power_error: null, limits: {}, ...more});
const pair = (measured, truth, more = {}) => (
    {name: `${measured}_vs_${truth}`, measured, truth, error: [base64(1e-9, 2e-9), null], ...more});
const page = (more = {}) => readData(JSON.stringify({
  drives: [{name: 'slide', unit: 'N', position_unit: 'm'}, {name: 'turn', unit: 'N m', position_unit: 'rad'}],
  time: [0, 0.5], witnesses: [witness('analytic'), witness('simulated')], pairs: [pair('simulated', 'analytic')],
  replay: {time: [0, 0.5], bodies: [{poses: base64(1, 2)}, {poses: [0, 0, 0, 0, 0, 0, 1]}]}, ...more}));
const titles = (data) => makePanels(data).map((panel) => panel.title);

test('Signals are decoded, and stay missing where they are', () => {
  const data = page();
  assert.deepEqual([...data.witnesses[0].force[1]], [3, 4]);
  assert.equal(data.witnesses[0].position[1], null);
  assert.equal(data.pairs[0].error[1], null);
  assert.deepEqual([...data.replay.bodies[0].poses], [1, 2]);
  assert.deepEqual(data.replay.bodies[1].poses, [0, 0, 0, 0, 0, 0, 1]);
});

test('Meshes are decoded as vertices and whole numbers of them', () => {
  const replay = {time: [0], bodies: [], surfaces: [{vertices: base64(0, 0.5, 1), triangles: base64(0, 1, 70000)}]};
  const [surface] = page({replay}).replay.surfaces;
  assert.deepEqual([...surface.vertices], [0, 0.5, 1]);
  assert.ok(surface.triangles instanceof Uint32Array);
  assert.deepEqual([...surface.triangles], [0, 1, 70000]);
  assert.equal(page().replay.surfaces, undefined);
});

test('A page without signals has a home pose only', () => {
  const data = page({time: undefined, witnesses: undefined, pairs: undefined});
  assert.deepEqual([...data.time], [0]);
  assert.equal(shownWitness(data), null);
  assert.equal(errorPair(data), null);
  assert.deepEqual(makePanels(data), []);
});

test('The simulation is shown if it ran, else the reference, else the closed form', () => {
  const failed = witness('simulated', {force: [base64(NaN, NaN), null]});
  assert.equal(shownWitness(page()).name, 'simulated');
  assert.equal(shownWitness(page({witnesses: [failed, witness('analytic'), witness('reference')]})).name, 'reference');
  assert.equal(shownWitness(page({witnesses: [failed, witness('analytic')]})).name, 'analytic');
});

test('Errors are of the simulation against the closed form where both ran', () => {
  const pairs = [pair('reference', 'analytic'), pair('simulated', 'analytic')];
  assert.equal(errorPair(page({pairs})).measured, 'simulated');
  pairs[1].error = [null, null];
  assert.equal(errorPair(page({pairs})).measured, 'reference');
});

test('The worst samples begin with the worst, each once', () => {
  const worst = (time, drive, value) => ({worst: {drive, time, value}});
  const pairs = [pair('a', 'b', worst(0, 1, 1e-9)), pair('c', 'd', worst(0.5, 0, 3e-9)), pair('e', 'f', worst(0, 0, 1e-10)),
                 pair('g', 'h', worst(null, 0, 1)), pair('i', 'j')];
  assert.deepEqual(worstSamples(page({pairs})), [{time: 0.5, value: 3e-9, label: 'c against d: slide'},
                                                 {time: 0, value: 1e-9, label: 'a against b: turn'}]);
});

test('Forces, errors, positions and outputs have a panel each, by unit', () => {
  assert.deepEqual(titles(page()), [
    'Drive forces', 'Drive torques', 'Force error: simulated against analytic', 'Drive positions',
    'Position of tool', 'Orientation of tool']);
  const [forces, , errors] = makePanels(page());
  assert.deepEqual(forces.lines.map(({key, style}) => [key, style]), [['slide', 'analytic'], ['slide', 'simulated']]);
  assert.deepEqual(errors.lines.map(({key, style}) => [key, style]), [['slide', 'solid']]);
  assert.equal(errors.pair, 'simulated_vs_analytic');
});

test('Angles are shown in degrees', () => {
  const orientation = makePanels(page()).find((panel) => panel.unit === '°');
  assert.ok(Math.abs(orientation.lines[0].values[1] - 180 / Math.PI) < 1e-5);
});

test('Loop gaps and power carry the limits of the simulation; panels without a number are left out', () => {
  const simulated = witness('simulated', {closure_m: base64(1e-12, 2e-12), power_error: base64(NaN, NaN),
                                          power_rate: base64(1, 2), limits: {closure_m: 1e-9}});
  const panels = makePanels(page({witnesses: [simulated]}));
  assert.equal(panels.find((panel) => panel.title === 'Largest loop gap').limit, 1e-9);
  assert.deepEqual(panels.find((panel) => panel.title === 'Power').lines.map(({key, dash}) => [key, dash]),
                   [['simulated, energy rate', true]]);
  assert.ok(!panels.some((panel) => panel.title === 'Power imbalance'));
});

test('Groups keep the order of their members', () => {
  assert.deepEqual([...groupBy(['b1', 'a1', 'b2'], (text) => text[0])], [['b', ['b1', 'b2']], ['a', ['a1']]]);
});

test('A force that friction at rest leaves open is a gap with a band', () => {
  const data = page({witnesses: [witness('reference', {band: [base64(0, 0.5), null]})]});
  const [line] = makePanels(data)[0].lines;
  assert.deepEqual([...line.values], [1, NaN]);
  assert.deepEqual([...line.band.lower], [NaN, 1.5]);
  assert.deepEqual([...line.band.upper], [NaN, 2.5]);
  assert.deepEqual(withBands([line], 1, 1), [1, 2.5]);
  assert.deepEqual(withBands([], null, null), [null, null]);
  assert.equal(makePanels(data)[1].lines[0].band, undefined);
});
