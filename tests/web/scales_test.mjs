// Axes of the plots in report.html, without a browser.
import assert from 'node:assert/strict';
import {test} from 'node:test';

import {axisLabels, largest, padded, plottable, powerOfTen, spread, zoomed} from '../../web/src/report/scales.js';

test('What is not finite is a gap, and a logarithmic axis has a floor', () => {
  assert.deepEqual(plottable([1, NaN, -2, Infinity]), [1, null, -2, null]);
  assert.deepEqual(plottable(new Float32Array([0, 1, NaN]), 0.5), [0.5, 1, null]);
});

test('Marks are spread evenly and stay where they are when the range moves', () => {
  const all = spread(0, 1000);
  assert.ok(all.length >= 48 && all.length <= 52);
  assert.ok(all.every((i, k) => k === 0 || i - all[k - 1] === all[1] - all[0]));
  const step = all[1] - all[0];
  assert.ok(spread(17, 1017).every((i) => i >= 17 && i <= 1017 && i % step === 0));
  assert.deepEqual(spread(2, 5), [2, 3, 4, 5]);
  assert.deepEqual(spread(3, 3), [3]);
});

test('Powers of ten have raised digits', () => {
  assert.deepEqual([1e-12, 1e-3, 1, 10, 1e20].map(powerOfTen), ['10⁻¹²', '10⁻³', '10⁰', '10¹', '10²⁰']);
});

test('All labels of an axis have one prefix', () => {
  assert.deepEqual(axisLabels([-20000, 0, 5000, null]), ['−20 k', '0 k', '5 k', '']);
  assert.deepEqual(axisLabels([0, 1.5e6]), ['0 M', '1.5 M']);
  assert.deepEqual(axisLabels([0, 0.1, 0.30000000000000004]), ['0', '0.1', '0.3']);
  assert.deepEqual(axisLabels([-1e-5, 0]), ['−1e−5', '0']);
});

test('A label says the value of its mark', () => {
  const scales = {'': 1, k: 1e3, M: 1e6};
  const valueOf = (label) => {
    const [digits, prefix = ''] = label.replaceAll('−', '-').split(' ');
    return Number(digits) * scales[prefix];
  };
  for (let exponent = -14; exponent <= 9; ++exponent) {
    for (const step of [1, 2, 2.5, 5]) {
      const marks = [-3, -1, 0, 1, 2, 3, 7].map((k) => k * step * 10 ** exponent);
      axisLabels(marks).forEach((label, i) => {
        assert.ok(Math.abs(valueOf(label) - marks[i]) <= 1e-6 * Math.abs(marks[i]), `${label} at ${marks[i]}`);
      });
    }
  }
});

test('A range has room above and below, and a constant signal is not blown up', () => {
  const [low, high] = padded(-1, 3);
  assert.ok(low < -1 && high > 3 && high - low < 5);
  const [bottom, top] = padded(100, 100 + 1e-9);
  assert.ok(bottom < 99.96 && top > 100.04);
  assert.deepEqual(padded(null, null), [0, 1]);
  assert.ok(padded(0, 0)[0] < 0);
});

test('Zooming keeps the time under the playhead in its place and stays inside the run', () => {
  const run = {start: 0, end: 10, sample: 0.01};
  assert.deepEqual(zoomed([0, 10], 0.5, 2, run), [1, 6]);
  assert.deepEqual(zoomed([4, 6], 0.5, 9, run), [4.5, 5.5], 'a time that is not visible');
  assert.deepEqual(zoomed([8, 10], 2, 10, run), [6, 10]);
  assert.deepEqual(zoomed([1, 6], 100, 2, run), [0, 10]);
  const [low, high] = zoomed([5, 5.05], 0.01, 5.01, run);
  assert.ok(Math.abs(high - low - 0.04) < 1e-12, 'four samples at least');
});

test('The largest value of all lines is found with its time and line', () => {
  const lines = [{key: 'a', values: [1, NaN, 2]}, {key: 'b', values: [0, -3, 1]}];
  assert.deepEqual(largest(lines, [0, 0.5, 1]), {value: 3, time: 0.5, key: 'b'});
  assert.equal(largest([{key: 'a', values: [NaN]}], [0]), null);
});
