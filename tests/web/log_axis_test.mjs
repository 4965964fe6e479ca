// Range and marks of logarithmic axes, without a browser.
import assert from 'node:assert/strict';
import {test} from 'node:test';

import {decadeMarks, decades} from '../../web/src/report/log_axis.js';

const of = (...values) => [{values}];

test('Decades hold the values and the limit', () => {
  assert.deepEqual(decades(of(3e-9, 2e-4)), [1e-9, 1e-3]);
  const [low, high] = decades(of(3e-9), 1e-2);
  assert.ok(low <= 3e-9 && high >= 1e-2);
});

test('Nothing above zero has no axis', () => {
  assert.equal(decades(of(0, 0, NaN, Infinity)), null);
});

test('Values far below round-off give a range that ends at 1e-20', () => {
  for (const values of [[1e-23, 2e-21], [1e-300], [5e-324, 1e-19]]) {
    const [low, high] = decades(of(...values));
    assert.ok(low >= 0.999e-20 && high > low, `${values}: ${low} ${high}`);
  }
});

test('Values over many decades show the upper sixteen', () => {
  const [low, high] = decades(of(1e-19, 1e3));
  assert.ok(Math.abs(Math.log10(high / low) - 16) < 1e-9);
});

test('Marks are whole decades inside the range, few and evenly spaced', () => {
  for (let low = -20; low < 10; ++low) {
    for (let high = low + 1; high < low + 17; ++high) {
      const exponents = decadeMarks(10 ** low, 10 ** high).map(Math.log10);
      assert.ok(exponents.length >= 1 && exponents.length <= 9, `${low} ${high}`);
      for (const e of exponents) {
        assert.ok(Math.abs(e - Math.round(e)) < 1e-9 && e >= low - 1e-9 && e <= high + 1e-9);
      }
    }
  }
});
