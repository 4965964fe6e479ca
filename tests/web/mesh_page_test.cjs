// A mesh in the replay, in a real browser; run.sh makes the page and names it in MBV_PAGE.
'use strict';
const assert = require('node:assert/strict');
const fs = require('node:fs');
const {after, before, test} = require('node:test');

const {launch, measurePixels, openPage, readyTime, settled} = require('./browser.cjs');

let browser, page;
const trouble = [], requests = [];

before(async () => {
  browser = await launch();
  page = await openPage(browser, process.env.MBV_PAGE, {trouble, requests});
  await readyTime(page);
  await settled(page);
});

after(() => browser?.close());

test('The mesh lies where the robot has it', async () => {
  const {triangles, low, high} = await page.evaluate(() => {
    const {replay, timeline} = globalThis.mbverify;
    timeline.set(timeline.start);
    const group = replay.bodies.groups.find((body) => body.name === 'arm');
    const mesh = group.children[0], {position} = mesh.geometry.attributes;
    mesh.updateMatrixWorld(true);
    const places = [...Array(position.count).keys()].map(
        (i) => group.position.clone().fromBufferAttribute(position, i).applyMatrix4(mesh.matrixWorld).toArray());
    const along = (/** @type {(...values: number[]) => number} */ most) =>
        [0, 1, 2].map((k) => most(...places.map((place) => place[k])));
    return {triangles: mesh.geometry.index.count / 3, low: along(Math.min), high: along(Math.max)};
  });
  assert.equal(triangles, 12);
  // 100 × 200 × 300 mm from the origin of the visual, (0, 0, 0.1) m.
  [0, 0, 0.1].forEach((x, k) => assert.ok(Math.abs(low[k] - x) < 1e-6, `${low}`));
  [0.1, 0.2, 0.4].forEach((x, k) => assert.ok(Math.abs(high[k] - x) < 1e-6, `${high}`));
});

test('The mesh is seen in its colour', async () => {
  const red = await measurePixels(page, '#scene', ({data, width, height}) => {
    let count = 0;
    for (let i = 0; i < data.length; i += 4) {
      if (data[i] > 90 && data[i] > 2 * data[i + 1] && data[i] > 2 * data[i + 2]) ++count;
    }
    return count / (width * height);
  });
  assert.ok(red > 0.02, `${red} of the picture`);
});

test('The page is small, asks for nothing and has no trouble', () => {
  assert.deepEqual(trouble, []);
  assert.equal(requests.filter((url) => !url.startsWith('data:')).length, 1);
  assert.ok(fs.statSync(process.env.MBV_PAGE).size < 5e6);
});
