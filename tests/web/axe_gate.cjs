// Accessibility by axe-core: node axe_gate.cjs FOLDER opens each report.html and index.html below
// FOLDER in a real browser (MBV_CHROMIUM), light and wide, then dark and narrow, and prints what axe
// finds.
// Exit code 1 if it finds anything, if there is no page, or if it does not find a fault that is
// planted into each page: a check that cannot fail says nothing.
'use strict';
const fs = require('node:fs');

const {gate, openPage, resize} = require('./browser.cjs');

const axe = fs.readFileSync(require.resolve('axe-core/axe.min.js'), 'utf8');

// Faults as [rule, element: text].
async function violations(page, where = 'html') {
  const {violations: found} = await page.evaluate((where) => globalThis.axe.run(where, {
    resultTypes: ['violations'],
    rules: {'target-size': {enabled: true}},
  }), where);
  return found.flatMap(({id, help, nodes}) => nodes.map(({target, failureSummary}) =>
    `${id} (${help}): ${target.join(' ')}: ${failureSummary.replace(/\s+/g, ' ').slice(0, 200)}`));
}

// What axe must find: a picture without text, and text that is hardly seen.
const plant = (page) => page.evaluate(() => {
  const image = document.createElement('img');
  image.src = 'data:image/gif;base64,R0lGODlhAQABAAAAACw=';
  const faint = document.createElement('p');
  faint.textContent = 'hardly seen';
  faint.style.setProperty('color', '#777');
  faint.style.setProperty('background-color', '#888');
  const planted = document.createElement('div');
  planted.id = 'planted';
  planted.append(image, faint);
  document.querySelector('main').append(planted);
});

async function faultsOf(browser, file) {
  const page = await openPage(browser, file, {trouble: [], requests: []});
  const script = await page.locator('#page-data').count() > 0;
  if (script) await page.waitForSelector('html[data-ready]');
  // Folded parts are content, too.
  await page.evaluate(() => document.querySelectorAll('details').forEach((part) => { part.open = true; }));
  await page.evaluate(axe);
  const faults = [];
  for (const [colorScheme, width] of [['light', 1400], ['dark', 390]]) {
    await page.emulateMedia({colorScheme, reducedMotion: 'reduce'});
    await resize(page, width, 900);
    for (const fault of await violations(page)) faults.push(`${colorScheme}, ${width} px: ${fault}`);
  }
  await plant(page);
  const planted = await violations(page, '#planted');
  for (const rule of ['image-alt', 'color-contrast']) {
    if (!planted.some((fault) => fault.startsWith(rule))) faults.push(`a planted fault of ${rule} is not found`);
  }
  await page.close();
  return faults;
}

gate(process.argv[2], faultsOf, 'are without violations');
