// Arrows and legs of the replay, without a browser.
import assert from 'node:assert/strict';
import {test} from 'node:test';

import {bentArrow, legParts, straightArrow} from '../../web/src/report/arrow_shape.js';

const near = (a, b) => assert.ok(Math.abs(a - b) < 1e-8, `${a}, not ${b}`);

// Start and end of head and shaft along the arrow.
function ends(length, push) {
  const {headScale, shaftLength, shaftMiddle, headMiddle} = straightArrow(length, 0.1, push);
  const head = 0.1 * headScale;
  return {head: [headMiddle - head / 2, headMiddle + head / 2],
          shaft: [shaftMiddle - shaftLength / 2, shaftMiddle + shaftLength / 2]};
}

test('A push ends in its head, a pull starts with it, and both are as long as the force is large', () => {
  for (const length of [0.01, 0.13, 1]) {
    const push = ends(length, true), pull = ends(length, false);
    near(push.shaft[0], 0);
    near(push.head[0], push.shaft[1]);
    near(push.head[1], length);
    near(pull.head[0], 0);
    near(pull.shaft[0], pull.head[1]);
    near(pull.shaft[1], length);
  }
});

test('A short arrow has a small head and still a shaft', () => {
  const {headScale, shaftLength} = straightArrow(0.026, 0.1, true);
  near(headScale, 0.2);
  near(shaftLength, 0.006);
  assert.equal(straightArrow(1, 0.1, true).headScale, 1);
  assert.ok(straightArrow(0, 0.1, true).shaftLength > 0);
});

test('An arc shows its share in whole segments, and its head lies at its end', () => {
  const arc = {radius: 2, angle: Math.PI, segments: 64};
  const half = bentArrow(0.5, arc, true);
  assert.equal(half.shown, 0.5);
  near(half.head[0], 0);
  near(half.head[1], 2);
  near(half.headAngle, Math.PI / 2);
  assert.equal(bentArrow(0, arc, true).shown, 1 / 64);
  const back = bentArrow(0.5, arc, false);
  near(back.head[1], -2);
  near(back.headAngle, Math.PI / 2);
});

test('A rod slides out of its sleeve, which is never longer than the leg', () => {
  assert.deepEqual(legParts(2, 1), {sleeve: [0, 0.55], rod: [0.9 * 0.55, 2]});
  assert.deepEqual(legParts(0.3, 1), {sleeve: [0, 0.3], rod: [0.3, 0.3]});
});
