// What every page must keep, whatever it shows: node page_gate.cjs FOLDER opens each report.html
// and index.html below FOLDER in a real browser (MBV_CHROMIUM), light and dark, wide, narrow and on
// paper. Prints what fails and exits with 1; a folder without pages fails, too.
'use strict';
const path = require('node:path');

const {gate, openPage, readyTime, resize, settled} = require('./browser.cjs');

const kReady_ms = 2000, kHeap_bytes = 200e6;

// Plots without a coloured curve, as [title].
const emptyPlots = (page) => page.evaluate(() => {
  // A copy that is made for reading: the browser warns about reading from others.
  const copy = document.createElement('canvas').getContext('2d', {willReadFrequently: true});
  const coloured = (canvas) => {
    [copy.canvas.width, copy.canvas.height] = [canvas.width, canvas.height];
    copy.drawImage(canvas, 0, 0);
    const {data} = copy.getImageData(0, 0, canvas.width, canvas.height);
    let count = 0;
    for (let i = 0; i < data.length; i += 4) {
      const [r, g, b, a] = data.subarray(i, i + 4);
      if (a > 60 && Math.max(r, g, b) - Math.min(r, g, b) > 40) ++count;
    }
    return count;
  };
  return (globalThis.mbverify?.plots?.views ?? [])
      .filter((view) => view.plot && coloured(view.plot.ctx.canvas) < 10)
      .map((view) => view.panel.title);
});

// Elements that reach beyond the right edge of the window.
const tooWide = (page) => page.evaluate(() => {
  const {scrollWidth, clientWidth} = document.documentElement;
  if (scrollWidth <= clientWidth) return [];
  const last = [...document.querySelectorAll('body *')].filter((node) =>
      !node.closest('.scroll, nav, svg, pre') && node.scrollWidth > Math.max(node.clientWidth, clientWidth) + 1).at(-1);
  return [`${scrollWidth} px in a window of ${clientWidth} px, ` +
          (last ? `${last.tagName} "${last.textContent.trim().slice(0, 60)}"` : 'cause not found')];
});

async function openOnce(browser, file) {
  const found = {trouble: [], requests: []};
  const page = await openPage(browser, file, found);
  const report = path.basename(file) === 'report.html';
  const bad = [];
  let ready_ms = 0;
  // Pages without data for a script (a stiffness) are ready as they are.
  if (report && await page.locator('#page-data').count() > 0) {
    try {
      ready_ms = await readyTime(page);
    } catch (error) {
      bad.push(`is not ready: ${error.message}`);
    }
  }
  return {page, found, bad, ready_ms};
}

async function faultsOf(browser, file) {
  let {page, found, bad, ready_ms} = await openOnce(browser, file);
  // One opening may be held up; a slow page is slow each time.
  for (let again = 0; again < 2 && ready_ms > kReady_ms; ++again) {
    await page.close();
    ({page, found, bad, ready_ms} = await openOnce(browser, file));
  }
  if (bad.length) {
    await page.close();
    return [...bad, ...found.trouble];
  }
  if (ready_ms > kReady_ms) bad.push(`ready after ${Math.round(ready_ms)} ms`);
  const check = async (state) => {
    await settled(page);
    for (const title of await emptyPlots(page)) bad.push(`${state}: empty plot "${title}"`);
    for (const text of await tooWide(page)) bad.push(`${state}: ${text}`);
  };
  for (const colorScheme of ['light', 'dark']) {
    await page.emulateMedia({colorScheme});
    for (const width of [1400, 390]) {
      await resize(page, width, 900);
      await check(`${colorScheme}, ${width} px`);
    }
  }
  await page.emulateMedia({media: 'print', colorScheme: 'dark'});
  await resize(page, 718, 1000);  // A4 between margins of 1 cm
  await page.evaluate(() => dispatchEvent(new Event('beforeprint')));
  await check('print');
  const cut = await page.evaluate(() => [...document.querySelectorAll('.plot canvas')]
      .filter((canvas) => canvas.getBoundingClientRect().right > innerWidth + 1).length);
  if (cut) bad.push(`print: ${cut} plots are cut`);
  const heap = await page.evaluate(() => performance.memory.usedJSHeapSize);
  if (heap > kHeap_bytes) bad.push(`heap of ${Math.round(heap / 1e6)} MB`);
  await page.close();
  const foreign = found.requests.filter((url) => !/^(data|file|blob):/.test(url));
  return [...bad, ...found.trouble, ...foreign.map((url) => `asks for ${url}`)];
}

gate(process.argv[2], faultsOf, 'keep their promises');
