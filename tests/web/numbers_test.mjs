// Numbers of report.html, without a browser.
import assert from 'node:assert/strict';
import {test} from 'node:test';

import {
  between, errorRange, floats, formatError, formatForce, formatValue, gridCells, indexAt, largestByUnit, logShare, nearest,
  rampPlace, smallestPositive,
} from '../../web/src/report/numbers.js';

test('Floats come back from base64 as they were written', () => {
  const bytes = Buffer.alloc(16);
  [1.5, -2e-20, NaN, Infinity].forEach((value, i) => bytes.writeFloatLE(value, 4 * i));
  assert.deepEqual([...floats(bytes.toString('base64'))], [1.5, Math.fround(-2e-20), NaN, Infinity]);
  assert.equal(floats('').length, 0);
});

test('A time finds the sample before it, and a rounded one its own', () => {
  const times = [0, 0.1, 0.2, 0.3];
  assert.deepEqual([-1, 0, 0.05, 0.1, 0.1 - 1e-12, 0.29, 0.3, 9].map((t) => indexAt(times, t)),
                   [0, 0, 0, 1, 1, 2, 3, 3]);
  assert.equal(indexAt([4], 0), 0);
});

test('The nearest sample lies on either side', () => {
  const times = [0, 1, 4];
  assert.deepEqual([-1, 0.4, 0.6, 2.4, 2.6, 9].map((t) => nearest(times, t)), [0, 0, 1, 1, 2, 2]);
});

test('Between two samples the share grows from 0 to 1, and it stays inside at the ends', () => {
  const times = [0, 1, 3];
  assert.deepEqual(between(times, 1.5), {from: 1, to: 2, share: 0.25});
  assert.deepEqual(between(times, -1), {from: 0, to: 1, share: 0});
  assert.deepEqual(between(times, 7), {from: 2, to: 2, share: 0});
  assert.deepEqual(between([2], 5), {from: 0, to: 0, share: 0});
  for (let t = 0; t <= 3; t += 0.01) {
    const {from, to, share} = between(times, t);
    assert.ok(Math.abs(times[from] + share * (times[to] - times[from]) - t) < 1e-12, String(t));
  }
});

test('Errors span six decades at most, zeros and gaps left out', () => {
  assert.deepEqual(errorRange([[0, 1e-9, NaN], null, [1e-6]]), [1e-9, 1e-6]);
  const [low, high] = errorRange([[1e-18, 1e-3]]);
  assert.equal(high, 1e-3);
  assert.ok(Math.abs(low / 1e-9 - 1) < 1e-12);
});

test('A share of a logarithmic range is 0 and 1 at its ends, and 0 without a value', () => {
  assert.ok(Math.abs(logShare(1e-9, [1e-9, 1e-3])) < 1e-12);
  assert.ok(Math.abs(logShare(1e-6, [1e-9, 1e-3]) - 0.5) < 1e-12);
  assert.ok(Math.abs(logShare(1e-3, [1e-9, 1e-3]) - 1) < 1e-12);
  for (const value of [0, NaN]) assert.equal(logShare(value, [1e-9, 1e-3]), 0);
  assert.equal(logShare(1e-3, [1e-3, 1e-3]), 0);
});

test('A ramp of colours is walked from its first stop to its last', () => {
  assert.deepEqual(rampPlace(0, 5), {stop: 0, rest: 0});
  assert.deepEqual(rampPlace(0.625, 5), {stop: 2, rest: 0.5});
  for (const share of [1, 1.7]) assert.deepEqual(rampPlace(share, 5), {stop: 3, rest: 1});
  assert.deepEqual(rampPlace(-3, 5), {stop: 0, rest: 0});
});

test('Values have four digits, a prefix where it reads better, and a true minus', () => {
  assert.equal(formatForce(3, 0, 'N m'), '3.000 N m');
  assert.equal(formatForce(3, 1000, 'N m'), '−997.0 N m … 1.003 kN m');
  assert.equal(formatValue(12.34567, 'N'), '12.35 N');
  assert.equal(formatValue(-1234.6, 'N'), '−1.235 kN');
  assert.equal(formatValue(2.5e6, 'N m'), '2.500 MN m');
  assert.equal(formatValue(1234.6, 'm'), '1235 m');
  assert.equal(formatValue(1e-5, 'm'), '1.00e−5 m');
  assert.equal(formatValue(0, 'm'), '0.000 m');
  assert.equal(formatValue(0.5), '0.5000');
  assert.equal(formatValue(-2.3e-16, 'm', 0.4), '0 m', 'round-off beside the largest');
  assert.equal(formatValue(5e-13, 'm', 0.4), '5.00e−13 m');
  assert.equal(formatValue(2.3e-16, 'm', 3e-16), '2.30e−16 m');
  assert.equal(formatValue(NaN, 'N'), '–');
});

test('Errors have two digits; zero and a gap have none', () => {
  assert.deepEqual([1.26e-9, 0, NaN, Infinity].map(formatError), ['1.3e-9', '0', '–', '–']);
});

test('The largest force of each unit is found, whatever its sign', () => {
  const drives = [{unit: 'N'}, {unit: 'N m'}, {unit: 'N'}, {unit: 'N'}];
  assert.deepEqual(largestByUnit(drives, [[1, -5], [2, NaN], [4], null]), {'N': 5, 'N m': 2});
  assert.deepEqual(largestByUnit(drives, []), {});
});

test('The smallest length above zero is found', () => {
  assert.equal(smallestPositive([0.7, 0, NaN, 0.4]), 0.4);
  assert.equal(smallestPositive([]), Infinity);
});

test('A floor has 8 to 66 cells, each a power of ten wide, and reaches beyond what stands on it', () => {
  for (let radius = 1e-3; radius < 1e4; radius *= 1.37) {
    const {cell, count} = gridCells(radius);
    assert.ok(Math.abs(Math.log10(cell) - Math.round(Math.log10(cell))) < 1e-9, `${radius} m: ${cell} m`);
    assert.ok(count >= 8 && count <= 66 && count % 2 === 0, `${radius} m: ${count} cells`);
    assert.ok(count * cell >= 3.2 * radius, `${radius} m: ${count} cells of ${cell} m`);
  }
});
