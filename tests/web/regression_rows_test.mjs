// Which rows of a regression run's table are shown and in which order, without a browser.
import assert from 'node:assert/strict';
import {test} from 'node:test';

import {compare, countsText, fits, grouped, idOf, linkOf, readRows, sorted as inOrder, wordsOf} from '../../web/src/regression/rows.js';

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

const texts = ['', 'agree', 'fails', 'At rest', 'worst at leg1', 'reaction: not unique'];
const data = {texts, rows: [
  ['b/one', 3, 0, 0, 2, 1e-3, 1e-9, [-3.5, -3], [['bad', 2], ['li', 4]], [], 2, 1, 40, 3],
  ['a/two', 0, 2, 1, 1, null, null, [], [], [5, 5], 1, 3, 30, 2],
  ['b/three', 0, 2, 0, 1, 2e-12, 1e-9, [-11.7], [], [], 3, 2, 50, 2]]};

test('Rows are read with their texts, and what is missing is not a number', () => {
  const [one, two] = readRows(data);
  assert.deepEqual([one.model, one.kind, one.description, one.word, one.limit], ['b', 'bad', 'At rest', 'fails', 1e-9]);
  assert.deepEqual(one.notes, [['bad', 'fails'], ['li', 'worst at leg1']]);
  assert.ok(Number.isNaN(two.error) && two.mustFail);
  assert.ok(fits(two, ['unique'], 'must_fail') && fits(one, ['leg1'], 'bad'));
});

test('Models stand where their worst scenario is, with counts', () => {
  const groups = grouped(readRows(data));
  assert.deepEqual(groups.map(({model, rows}) => [model, rows.length]), [['b', 2], ['a', 1]]);
  assert.equal(countsText(groups[0].counts), '2 scenarios: 1 as expected, 1 not as expected');
  assert.equal(countsText(groups[1].counts), '1 scenario: 1 as expected');
});

test('A column orders all rows, both ways', () => {
  const keys = (column, up) => inOrder(readRows(data), column, up).map(({key}) => key);
  assert.deepEqual(keys('scenario', true), ['a/two', 'b/one', 'b/three']);
  assert.deepEqual(keys('error', true), ['b/three', 'b/one', 'a/two'], 'without an error last');
  assert.deepEqual(keys('error', false), ['b/one', 'b/three', 'a/two']);
  assert.deepEqual(keys('wall', false), ['b/three', 'b/one', 'a/two']);
});

test('Links lead to the file whatever its name', () => {
  const key = 'javascript:alert(1)/a#b?c%d"<!--<script>é';
  assert.equal(linkOf(key), 'javascript%3Aalert%281%29/a%23b%3Fc%25d%22%3C%21--%3Cscript%3E%C3%A9');
  assert.ok(!/[%#?<& ]/.test(idOf(key)));
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
