// The pages of a regression run in a real browser; run.sh makes the run and names it in MBV_NIGHT.
'use strict';
const assert = require('node:assert/strict');
const fs = require('node:fs');
const path = require('node:path');
const {after, before, test} = require('node:test');
const {pathToFileURL} = require('node:url');
const {isDeepStrictEqual} = require('node:util');

const {kPatience_ms, launch, openPage, resize} = require('./browser.cjs');

const folder = process.env.MBV_REGRESSION;
const index_file = path.join(folder, 'index.html');

let browser, page;
const trouble = [], requests = [];

before(async () => {
  browser = await launch();
  page = await openPage(browser, index_file, {trouble, requests});
});

after(() => browser?.close());

const names = () => page.$$eval('tr.case th', (cells) => cells.map(
    (cell) => cell.firstChild.textContent));
// A step through the history ends a little after the call that asks for it.
async function becomes(read, wanted) {
  const last = Date.now() + kPatience_ms;
  while (!isDeepStrictEqual(await read(), wanted) && Date.now() < last) await page.waitForTimeout(20);
  assert.deepEqual(await read(), wanted);
}
const sortBy = (name) => page.click(`thead button:text-is("${name}")`);
const numbers = (column) => page.$$eval('tr.case', (rows, i) => rows.map((row) => row.cells[i].dataset.sort)
    .filter((text) => text !== '').map(Number), column);

test('One row per scenario, without errors and without any request', async () => {
  assert.equal((await names()).length, 6);
  assert.equal(await page.textContent('#shown'), '6 of 6 scenarios');
  assert.deepEqual(trouble, []);
  assert.deepEqual(requests.filter((url) => !url.startsWith('data:')), [pathToFileURL(index_file).href]);
  assert.match(await page.textContent('h1'), /not as expected/);
});

test('Words find scenarios by name and by text, all of them must occur', async () => {
  const texts = () => page.$$eval('tr.case', (all) => all.map((row) => row.textContent.toLowerCase()));
  const all = await texts();
  for (const words of [['tripod'], ['tripod', 'must_fail']]) {
    await page.fill('#find', words.join(' ').toUpperCase());
    const has = (text) => words.every((word) => text.includes(word));
    const shown = await texts();
    assert.ok(shown.length > 0 && shown.every(has), shown.join());
    assert.equal(shown.length, all.filter(has).length);
    assert.equal(await page.textContent('#shown'), `${shown.length} of 6 scenarios`);
  }
  assert.ok((await names()).includes('spr_tripod/must_fail/simulated_com'));
  await page.fill('#find', 'no such words');
  assert.deepEqual(await names(), []);
  await page.fill('#find', '');
  assert.equal((await names()).length, 6);
});

test('What failed can be shown alone, with its reason', async () => {
  await page.selectOption('#kind', 'bad');
  const bad = await names();
  assert.deepEqual(bad.map((name) => name.split('/').at(-1)), ['tight', 'wrong_expectation']);
  assert.match(await page.innerText('tr.case >> nth=1'), /exit code 0, expected 1/);
  await page.selectOption('#kind', 'good');
  assert.equal((await names()).length, 4);
  await page.selectOption('#kind', '');
});

test('What went wrong stands above the table: check, value, limit, place, and when it was well', async () => {
  const boxes = await page.$$eval('.box h2', (all) => all.map((h) => h.textContent));
  assert.deepEqual(boxes, ['2 not as expected', '1 missing']);
  const text = (await page.innerText('.box.bad')).replace(/\s+/g, ' ');
  assert.match(text, /wrong_expectation: unexpected|wrong_expectation unexpected/);
  assert.match(text, /exit code 0, expected 1/);
  // tight: its limits were made smaller after the first run.
  assert.match(text, /drive force, RMS \(simulated vs analytic\) is [\d.]+e-\d+, limit 1\.0e-2\d/);
  assert.match(text, /, at leg\d\.drive\.force|, at \w+\.force/);
  assert.match(text, /; was [\d.]+e-\d+ in run 1/);
  assert.match(text, /was ok in run 1 of /);
  assert.match(await page.innerText('.box:last-of-type'), /gone: was in run 1 of/);
});

test('The worst comes first, and links of the box lead to its row', async () => {
  const groups = await page.$$eval('tbody', (all) => all.map((group) => ({
    text: group.querySelector('.group').textContent,
    kinds: [...group.querySelectorAll('.case')].map((row) => row.dataset.kind)})));
  const order = ['bad', 'warn', 'good'];
  const places = (kinds) => kinds.map((kind) => order.indexOf(kind));
  for (const {kinds, text} of groups) {
    assert.deepEqual(places(kinds), places(kinds).sort());
    assert.match(text, new RegExp(`${kinds.length} scenarios?: `));
  }
  const first = places(groups.map(({kinds}) => kinds[0]));
  assert.equal(first[0], 0);
  assert.deepEqual(first, [...first].sort());
  assert.equal(await page.getAttribute('thead th[data-key=result]', 'aria-sort'), 'ascending');
  await page.selectOption('#kind', 'good');
  const href = await page.getAttribute('.box.bad a', 'href');
  await page.click('.box.bad a');
  await becomes(() => page.evaluate(() => decodeURIComponent(location.hash)), href);
  // A hidden row is shown again.
  await becomes(() => page.$$eval('.target', (rows) => rows.map((row) => {
    const {top, bottom} = row.getBoundingClientRect();
    return top >= 0 && bottom <= innerHeight + row.offsetHeight;
  })), [true]);
  await page.goto(pathToFileURL(index_file).href);
});

test('A model is folded and unfolded', async () => {
  const all = await names();
  const model = page.locator('.group button').first();
  const count = await page.locator('tbody').first().locator('.case').count();
  assert.equal(await model.getAttribute('aria-expanded'), 'true');
  await model.click();
  assert.equal((await names()).length, all.length - count);
  assert.equal(await model.getAttribute('aria-expanded'), 'false');
  await model.click();
  assert.deepEqual(await names(), all);
});

test('Filter and order are in the address, and the way back leads through them', async () => {
  const fresh = pathToFileURL(index_file).href;
  await page.goto(fresh);
  await page.selectOption('#kind', 'must_fail');
  const must_fail = await names();
  assert.ok(must_fail.length >= 2 && must_fail.every((name) => /must_fail|literal|wrong_exp/.test(name)), must_fail.join());
  await sortBy('error');
  await sortBy('error');
  await page.fill('#find', 'tripod');
  // Not page.url(), which learns of a change a little later.
  const [state, shown] = [await page.evaluate(() => location.href), await names()];
  assert.match(state, /#\?.*show=must_fail/);
  assert.match(state, /sort=-error/);
  assert.match(state, /find=tripod/);
  const other = await openPage(browser, index_file, {trouble, requests: []});
  await other.goto('about:blank');
  await other.goto(state);
  assert.deepEqual(await other.$$eval('tr.case th', (cells) => cells.map(
      (cell) => cell.firstChild.textContent)), shown);
  assert.equal(await other.inputValue('#find'), 'tripod');
  await other.close();
  const sorted = (key) => page.getAttribute(`thead th[data-key=${key}]`, 'aria-sort');
  await page.goBack();
  await becomes(() => page.inputValue('#find'), '');
  await becomes(() => sorted('error'), 'descending');
  await page.goBack();
  await becomes(() => sorted('error'), 'ascending');
  await page.goBack();
  await becomes(() => sorted('result'), 'ascending');
  await becomes(names, must_fail);
  await page.goBack();
  await becomes(() => page.inputValue('#kind'), '');
  assert.equal((await names()).length, 6);
  await page.goForward();
  await becomes(names, must_fail);
  await page.goto('about:blank');
  await page.goto(fresh);
});

test('The head of the table stays in sight', async () => {
  for (const width of [1400, 390]) {
    await resize(page, width, 300);
    await page.evaluate(() => scrollTo(0, document.body.scrollHeight));
    const top = await page.$eval('thead', (head) => head.getBoundingClientRect().top);
    assert.ok(Math.abs(top) <= 1, `${width} px: ${top}`);
    const button = await page.$eval('thead button', (node) => {
      const {left, top, width, height} = node.getBoundingClientRect();
      return document.elementFromPoint(left + width / 2, top + height / 2) === node;
    });
    assert.ok(button, `${width} px: the buttons can be reached`);
  }
  await page.evaluate(() => scrollTo(0, 0));
  await resize(page, 1280, 900);
});

test('A click on a column sorts by it, a second one the other way', async () => {
  await sortBy('scenario');
  const up = await names();
  assert.deepEqual(up, [...up].sort());
  await sortBy('scenario');
  assert.deepEqual(await names(), [...up].reverse());
  assert.equal(await page.getAttribute('thead th:has(button:text-is("scenario"))', 'aria-sort'), 'descending');
  await sortBy('wall [s]');
  const column = await page.$eval('thead button:text-is("wall [s]")', (button) => button.parentElement.cellIndex);
  const walls = await numbers(column);
  assert.equal(walls.length, 6);
  assert.deepEqual(walls, [...walls].sort((a, b) => a - b));
  // Scenarios without an error come last.
  await sortBy('error');
  const errors = await page.$$eval('tr.case', (rows) => rows.map((row) => row.cells[2].dataset.sort));
  const first_empty = errors.indexOf('');
  assert.ok(first_empty > 0 && errors.slice(first_empty).every((text) => text === ''), errors.join());
  assert.equal(await page.locator('thead th[aria-sort]').count(), 1);
});

test('A second run gives each compared scenario a curve of its past', async () => {
  assert.ok(await page.locator('tbody svg polyline').count() >= 3);
  assert.match(await page.getAttribute('tbody svg', 'aria-label'), /last 2 runs/);
});

test('Every report of the run opens without errors and requests nothing but the page\'s script', async () => {
  const script = fs.readdirSync(folder).filter((name) => /^report-[0-9a-f]{16}\.js$/.test(name));
  assert.equal(script.length, 1, 'one for all reports');
  const links = await page.$$eval('tbody a', (all) => all.map((a) => a.getAttribute('href')).filter(
      (href) => href.endsWith('report.html')));
  assert.ok(links.length >= 4, links.join());
  for (const link of links) {
    const file = path.join(folder, link);
    const found = {trouble: [], requests: []};
    const report = await openPage(browser, file, found);
    await report.waitForSelector('html[data-ready]');
    const summary = JSON.parse(fs.readFileSync(path.join(path.dirname(file), 'summary.json')));
    const word = {agree: 'Agree', disagree: 'Disagree', not_run: 'Not run'}[summary.verdict];
    assert.ok((await report.innerText('.verdict')).includes(word), link);
    assert.deepEqual(found.trouble, [], link);
    assert.deepEqual(found.requests.filter((url) => !url.startsWith('data:')),
        [file, path.join(folder, script[0])].map((name) => pathToFileURL(name).href), link);
    assert.ok(fs.statSync(file).size < 3e6, link);
    await report.close();
  }
});

test('A phone needs no horizontal scrolling of the page', async () => {
  await resize(page, 390, 740);
  const {scroll, client} = await page.evaluate(() => ({scroll: document.documentElement.scrollWidth,
                                                       client: document.documentElement.clientWidth}));
  assert.ok(scroll <= client, `${scroll} > ${client}`);
  const cut = await page.$$eval('tbody tr > *', (cells) => cells.filter(
      (cell) => cell.offsetWidth > 0 && cell.getBoundingClientRect().right > innerWidth + 1).map((cell) => cell.textContent));
  assert.deepEqual(cut, [], 'cells beyond the edge');
});

test('Nothing went wrong on the way', () => assert.deepEqual(trouble, []));
