// Filter and order of a regression run's table in the address, without a browser.
import assert from 'node:assert/strict';
import {test} from 'node:test';

import {fromHash, kUsual, rowOf, toHash} from '../../web/src/regression/address.js';

const kKinds = ['', 'bad', 'warn', 'good', 'must_fail'], kKeys = ['scenario', 'result', 'error', 'wall'];
const read = (hash) => fromHash(hash, kKinds, kKeys);

test('Every state comes back from its address', () => {
  for (const find of ['', 'tripod must_fail', 'a&b=c #?%', '数 °']) {
    for (const show of kKinds) {
      for (const key of kKeys) {
        for (const up of [true, false]) {
          const state = {find, show, key, up};
          assert.deepEqual(read(toHash(state)), state, toHash(state));
        }
      }
    }
  }
});

test('What is as usual is not in the address', () => {
  assert.equal(toHash(kUsual), '#');
  assert.equal(toHash({...kUsual, key: 'error', up: false}), '#?sort=-error');
  assert.equal(toHash({...kUsual, up: false}), '#?sort=-result');
  assert.equal(toHash({...kUsual, find: 'x y', show: 'bad'}), '#?find=x+y&show=bad');
});

test('Addresses without a state, and unknown kinds and columns, are as usual', () => {
  for (const hash of ['', '#', '#?', '#case/four_bar/static', '#?show=worst', '#?sort=-colour', '#?sort=']) {
    assert.deepEqual(read(hash), kUsual, hash);
  }
  assert.deepEqual(read('#?show=worst&find=x'), {...kUsual, find: 'x'});
});

test('An address leads to a row, or has a state', () => {
  assert.equal(rowOf('#case/four_bar/static'), 'case/four_bar/static');
  assert.equal(rowOf('#?find=x'), '');
  assert.equal(rowOf('#'), '');
  assert.equal(rowOf(''), '');
});
