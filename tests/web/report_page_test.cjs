// report.html in a real browser; run.sh makes the page and names it in MBV_PAGE.
'use strict';
const assert = require('node:assert/strict');
const fs = require('node:fs');
const {after, before, test} = require('node:test');
const {pathToFileURL} = require('node:url');

const {launch, measurePixels, openPage, readyTime, resize, settled} = require('./browser.cjs');

const page_file = process.env.MBV_PAGE;

let browser, page, ready_ms;
const trouble = [], requests = [];

// Different colours on a canvas element: 1 means blank.
const coloursOf = (selector) =>
  measurePixels(page, selector, ({data}) => new Set(new Uint32Array(data.buffer)).size);

const time = () => page.evaluate(() => globalThis.mbverify.timeline.time);
const frame = () => settled(page);

before(async () => {
  browser = await launch();
  page = await openPage(browser, page_file, {trouble, requests});
  ready_ms = await readyTime(page);
  await frame();
});

after(() => browser?.close());

test('The page loads fast, without errors and without any request', async () => {
  assert.deepEqual(trouble, []);
  assert.deepEqual(requests.filter((url) => !url.startsWith('data:')), [pathToFileURL(page_file).href]);
  console.log(`page of ${fs.statSync(page_file).size} bytes is ready after ${Math.round(ready_ms)} ms`);
  assert.ok(ready_ms < 10000, `${ready_ms} ms`);
  assert.ok(fs.statSync(page_file).size < 3e6);
});

test('The verdict, its checks and how to repeat it are text on the page', async () => {
  const text = await page.innerText('body');
  for (const part of ['Agree', 'checks are within their limits', 'mbverify run ', 'drive force, RMS']) {
    assert.ok(text.includes(part), part);
  }
});

test('Every plot is drawn', async () => {
  const count = await page.locator('.plot canvas').count();
  assert.ok(count >= 6, `${count} plots`);
  for (let i = 0; i < Math.min(count, 3); ++i) {
    assert.ok(await coloursOf(`.panel:nth-child(${i + 1}) .plot`) > 20, `plot ${i} is blank`);
  }
});

test('The replay shows the mechanism and moves it with the time', async () => {
  assert.ok(await coloursOf('#scene') > 100);
  const before = await page.locator('#scene').screenshot();
  await page.evaluate(() => {
    const {timeline} = globalThis.mbverify;
    timeline.set(timeline.start + 0.37 * (timeline.end - timeline.start));
  });
  await frame();
  assert.notDeepEqual(await page.locator('#scene').screenshot(), before);
  const moved = await page.evaluate(() => {
    const {replay, timeline} = globalThis.mbverify;
    const places = () => replay.bodies.groups.map((body) => body.position.toArray());
    timeline.set(timeline.start);
    const first = places();
    timeline.set(timeline.start + 0.37 * (timeline.end - timeline.start));
    return Math.max(...places().flatMap((p, i) => p.map((x, k) => Math.abs(x - first[i][k]))));
  });
  assert.ok(moved > 1e-3, `${moved} m`);
});

test('Play lets the time pass, and pause stops it', async () => {
  // Slowly, so that the run does not end before the pause.
  await page.evaluate(() => Object.assign(globalThis.mbverify.timeline, {speed: 0.1}).set(0));
  await page.click('#play');
  await page.waitForFunction(() => globalThis.mbverify.timeline.time > 0.01);
  await page.click('#play');
  const stopped = await time();
  await page.waitForTimeout(150);
  assert.equal(await time(), stopped);
  await page.evaluate(() => { globalThis.mbverify.timeline.speed = 1; });
});

test('Keys move the time, the zoom and the colour scheme', async () => {
  await page.evaluate(() => { document.activeElement.blur(); globalThis.mbverify.timeline.set(0); });
  await page.keyboard.press('ArrowRight');
  const one = await time();
  assert.ok(one > 0);
  await page.keyboard.press('Shift+ArrowRight');
  assert.ok(Math.abs(await time() - 11 * one) < 1e-9);
  await page.keyboard.press('End');
  assert.equal(await time(), await page.evaluate(() => globalThis.mbverify.timeline.end));
  const span = () => page.evaluate(() => {
    const {range} = globalThis.mbverify.plots;
    return range[1] - range[0];
  });
  const whole = await span();
  await page.keyboard.press('+');
  assert.ok(Math.abs(await span() - whole / 2) < 1e-9);
  const seen = await page.evaluate(() => globalThis.mbverify.plots.views.filter((view) => view.plot).map(
      (view) => view.plot.scales.x.max - view.plot.scales.x.min));
  assert.ok(seen.every((width) => Math.abs(width - whole / 2) < 1e-9), 'all plots zoom together');
  await page.keyboard.press('0');
  assert.equal(await span(), whole);
  const paper = () => page.evaluate(() => getComputedStyle(document.body).backgroundColor);
  const seenPapers = new Set();
  for (let i = 0; i < 3; ++i) {
    await page.keyboard.press('t');
    seenPapers.add(await paper());
  }
  assert.equal(seenPapers.size, 2);
});

test('A click into a plot sets the time, a drag zooms all plots', async () => {
  const over = page.locator('.panel .u-over').first();
  await over.evaluate((node) => node.scrollIntoView({block: 'center'}));
  await frame();
  const box = await over.boundingBox();
  await page.mouse.click(box.x + box.width / 2, box.y + box.height / 2);
  const {start, end} = await page.evaluate(() => {
    const {timeline} = globalThis.mbverify;
    return {start: timeline.start, end: timeline.end};
  });
  assert.ok(Math.abs(await time() - (start + end) / 2) < 0.01 * (end - start));
  await page.mouse.move(box.x + 0.25 * box.width, box.y + 20);
  await page.mouse.down();
  await page.mouse.move(box.x + 0.5 * box.width, box.y + 30, {steps: 4});
  await page.mouse.up();
  const ranges = await page.evaluate(() => globalThis.mbverify.plots.views.filter((view) => view.plot).map(
      (view) => [view.plot.scales.x.min, view.plot.scales.x.max]));
  for (const [min, max] of ranges) {
    assert.ok(Math.abs(max - min - 0.25 * (end - start)) < 0.02 * (end - start), `${min} ${max}`);
  }
  // Every playhead stands where its own axis has the time of the click.
  await frame();
  const off = await page.evaluate(() => {
    const {plots, timeline} = globalThis.mbverify;
    return plots.views.filter((view) => view.plot).map((view) => {
      const at = new DOMMatrix(getComputedStyle(view.head).transform).m41;
      const {min, max} = view.plot.scales.x;
      return Math.abs(at - (timeline.time - min) / (max - min) * view.plot.over.clientWidth);
    });
  });
  assert.ok(off.length > 3 && off.every((pixels) => pixels < 1.5), off.join());
  await page.keyboard.press('0');
});

test('The arrow keys turn the replay while it has the focus', async () => {
  const view = () => page.evaluate(() => globalThis.mbverify.replay.view.camera.position.toArray());
  await page.focus('#scene');
  const [before, then] = [await view(), await time()];
  await page.keyboard.press('ArrowRight');
  assert.notDeepEqual(await view(), before);
  assert.equal(await time(), then);
  await page.keyboard.press('r');
});

test('The worst samples of the summary are marked on the timeline', async () => {
  await page.evaluate(() => { document.activeElement.blur(); globalThis.mbverify.timeline.set(0.5); });
  await page.keyboard.press('w');
  const worst = await page.evaluate(() => globalThis.mbverify.timeline.worst.map((w) => w.time));
  assert.ok(worst.includes(await time()));
  assert.equal(await page.locator('.marks i').count(), worst.length);
});

test('Every control has a name, and images have a text', async () => {
  const nameless = await page.evaluate(() => [...document.querySelectorAll('button, input, select, img, canvas[role]')]
      .filter((node) => !(node.getAttribute('aria-label') || node.textContent.trim() || node.alt ||
                          node.labels?.length)).map((node) => node.outerHTML.slice(0, 80)));
  assert.deepEqual(nameless, []);
});

for (const [name, scheme] of [['light', 'light'], ['dark', 'dark']]) {
  test(`Text has enough contrast in the ${name} scheme`, async () => {
    await page.evaluate((theme) => { document.documentElement.dataset.theme = theme; }, scheme);
    const low = await page.evaluate(() => {
      const numbers = (text) => text.match(/[\d.]+/g).map(Number);
      const light = ([r, g, b]) => [r, g, b].map((c) => c / 255)
          .map((c) => c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4)
          .reduce((sum, c, i) => sum + c * [0.2126, 0.7152, 0.0722][i], 0);
      const paper = (node) => {
        for (let at = node; at; at = at.parentElement) {
          const color = numbers(getComputedStyle(at).backgroundColor);
          if (color.length === 3 || color[3] > 0) return color;
        }
        return [255, 255, 255];
      };
      const bad = [];
      for (const node of document.querySelectorAll('p, td, th, b, a, dt, span, summary, button, li')) {
        if (!node.textContent.trim() || node.closest('.tip, .skip, [aria-pressed=false]')) continue;
        const [a, b] = [light(numbers(getComputedStyle(node).color)), light(paper(node))];
        const ratio = (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05);
        if (ratio < 4.5) bad.push(`${ratio.toFixed(2)} ${node.className} ${node.textContent.slice(0, 30)}`);
      }
      return bad;
    });
    assert.deepEqual(low, []);
  });
}

test('A phone needs no horizontal scrolling', async () => {
  await resize(page, 360, 740);
  await page.waitForFunction(() => globalThis.mbverify.plots.views.every(
      (view) => !view.plot || view.plot.width <= 360));
  const {scroll, client} = await page.evaluate(() => ({scroll: document.documentElement.scrollWidth,
                                                       client: document.documentElement.clientWidth}));
  assert.ok(scroll <= client, `${scroll} > ${client}`);
});

test('Without JavaScript the verdict, the tables and the pictures remain', async () => {
  const context = await browser.newContext({javaScriptEnabled: false});
  const plain = await context.newPage();
  await plain.goto(pathToFileURL(page_file).href);
  assert.ok((await plain.innerText('main')).includes('checks are within their limits'));
  assert.ok(await plain.locator('#checks tbody tr').count() > 5);
  assert.ok(await plain.locator('#snapshots img').count() >= 1);
  assert.equal(await plain.locator('.timeline').count(), 0);
  // Plots that do not move: forces and errors, one curve per drive.
  assert.equal(await plain.locator('.static-plots svg').count(), 2);
  for (const plot of await plain.locator('.static-plots svg').all()) {
    assert.equal(await plot.locator('path').count(), 6);
    const box = await plot.boundingBox();
    assert.ok(box.width > 200 && box.height > 100, JSON.stringify(box));
  }
  await context.close();
});

test('Nothing went wrong on the way', () => assert.deepEqual(trouble, []));
