// Which rows of a regression run's table are shown and in which order, without a browser.
import assert from 'node:assert/strict';
import {test} from 'node:test';

import {compare, fits, sortValue, wordsOf} from '../../web/src/regression/rows.js';

const row = (text, kind = 'good', mustFail = false) => ({text, kind, mustFail});
const sorted = (values, up) => [...values].sort((a, b) => compare(a, b, up));

test('Words are separated by any space and do not distinguish case', () => {
  assert.deepEqual(wordsOf('  Tripod\tMUST_fail '), ['tripod', 'must_fail']);
  assert.deepEqual(wordsOf(''), []);
});

test('All words must occur, in any order and inside of longer ones', () => {
  const tripod = row('spr_tripod/must_fail/simulated_com');
  assert.ok(fits(tripod, wordsOf('fail TRIP'), ''));
  assert.ok(!fits(tripod, wordsOf('tripod scara'), ''));
  assert.ok(fits(tripod, [], ''));
});

test('A kind shows its rows only, and what must fail is shown whatever became of it', () => {
  const rows = [row('a'), row('b', 'bad'), row('c', 'good', true), row('d', 'bad', true)];
  const shown = (show) => rows.filter((one) => fits(one, [], show)).map(({text}) => text).join('');
  assert.deepEqual(['', 'good', 'bad', 'warn', 'must_fail'].map(shown), ['abcd', 'ac', 'bd', '', 'cd']);
  assert.ok(!fits(rows[0], ['b'], 'good'));
});

test('A cell is sorted by its number, by nothing if that is empty, else by its text', () => {
  assert.equal(sortValue('2.5e-9', '2.5e-9 of …'), 2.5e-9);
  assert.ok(Number.isNaN(sortValue('', '–')));
  assert.equal(sortValue(undefined, 'four_bar/static'), 'four_bar/static');
});

test('What is missing comes last, both ways', () => {
  assert.deepEqual(sorted([NaN, 1e-3, NaN, -Infinity, 2e-9], true), [-Infinity, 2e-9, 1e-3, NaN, NaN]);
  assert.deepEqual(sorted([NaN, 1e-3, NaN, 2e-9], false), [1e-3, 2e-9, NaN, NaN]);
});

test('Texts are sorted by their characters, and equal ones keep their order', () => {
  assert.deepEqual(sorted(['b/2', 'a', 'b/10'], true), ['a', 'b/10', 'b/2']);
  assert.deepEqual(sorted(['a', 'c', 'b'], false), ['c', 'b', 'a']);
  assert.equal(compare(3, 3, true), 0);
  assert.equal(Math.abs(compare('x', 'x', false)), 0);
});
