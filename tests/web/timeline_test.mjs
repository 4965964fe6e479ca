// The time that plots and replay share, with frames of the test instead of a browser's.
import assert from 'node:assert/strict';
import {beforeEach, test} from 'node:test';

import {Timeline} from '../../web/src/report/timeline.js';

let timeline, seen, frames, now_ms;

// Draws the next frame `ms` after the one before.
function frame(ms) {
  now_ms += ms;
  const due = frames;
  frames = [];
  for (const draw of due) draw(now_ms);
}

beforeEach(() => {
  frames = [];
  now_ms = 5000;
  globalThis.requestAnimationFrame = (draw) => frames.push(draw);
  performance.now = () => now_ms;
  timeline = new Timeline({start: 1, end: 3, sample: 0.1,
                           worst: [{time: 2.5, label: 'a'}, {time: 1.5, label: 'b'}]});
  seen = [];
  timeline.onChange((time) => seen.push(time));
});

test('A time is kept inside the run and reported to every listener', () => {
  const also = [];
  timeline.onChange((time) => also.push(time));
  for (const time of [2, -7, 99]) timeline.set(time);
  assert.deepEqual(seen, [2, 1, 3]);
  assert.deepEqual(also, seen);
});

test('Steps go by whole samples, and end at the ends', () => {
  timeline.set(1.234);
  timeline.step(1);
  assert.ok(Math.abs(timeline.time - 1.3) < 1e-12);
  timeline.step(-2);
  assert.ok(Math.abs(timeline.time - 1.1) < 1e-12);
  timeline.step(-10);
  assert.equal(timeline.time, 1);
});

test('Playing follows the clock by its speed, and stops at the end', () => {
  timeline.speed = 2;
  timeline.play();
  frame(100);
  assert.ok(Math.abs(timeline.time - 1.2) < 1e-12);
  frame(100);
  assert.ok(Math.abs(timeline.time - 1.4) < 1e-12);
  for (let i = 0; i < 20; ++i) frame(100);
  assert.equal(timeline.time, 3);
  assert.ok(!timeline.playing);
  assert.equal(frames.length, 0, 'no frame is asked for any more');
});

test('Playing at the end starts again, and a page that was hidden does not jump', () => {
  timeline.set(3);
  timeline.play();
  assert.equal(timeline.time, 1);
  frame(60000);
  assert.ok(Math.abs(timeline.time - 1.25) < 1e-12);
});

test('Pause, a step and a jump to the worst sample stop the time', () => {
  for (const stop of [() => timeline.play(), () => timeline.step(1), () => timeline.nextWorst()]) {
    timeline.play(true);
    frame(16);
    stop();
    const {time} = timeline;
    frame(16);
    assert.equal(timeline.time, time);
  }
});

test('The first jump goes to the worst sample, wherever the time is; the next ones go round', () => {
  timeline.set(2);
  const visited = [];
  for (let i = 0; i < 3; ++i) {
    timeline.nextWorst();
    visited.push(timeline.time);
  }
  assert.deepEqual(visited, [2.5, 1.5, 2.5]);
});

test('A run of one moment does not play', () => {
  const moment = new Timeline({start: 0, end: 0, sample: 1, worst: []});
  moment.play();
  moment.nextWorst();
  assert.ok(!moment.playing);
  assert.equal(frames.length, 0);
});
