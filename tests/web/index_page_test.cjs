// The pages of a regression run in a real browser; run.sh makes the run and names it in MBV_NIGHT.
'use strict';
const assert = require('node:assert/strict');
const fs = require('node:fs');
const path = require('node:path');
const {after, before, test} = require('node:test');
const {pathToFileURL} = require('node:url');

const {launch, openPage} = require('./browser.cjs');

const night = process.env.MBV_NIGHT;
const index_file = path.join(night, 'index.html');

let browser, page;
const trouble = [], requests = [];

before(async () => {
  browser = await launch();
  page = await openPage(browser, index_file, {trouble, requests});
});

after(() => browser?.close());

const names = () => page.$$eval('tbody tr:not([hidden]) th', (cells) => cells.map(
    (cell) => cell.firstChild.textContent));
const sortBy = (name) => page.click(`thead button:text-is("${name}")`);
const numbers = (column) => page.$$eval('tbody tr', (rows, i) => rows.map((row) => row.cells[i].dataset.sort)
    .filter((text) => text !== '').map(Number), column);

test('One row per scenario, without errors and without any request', async () => {
  assert.equal((await names()).length, 5);
  assert.equal(await page.textContent('#shown'), '5 of 5 scenarios');
  assert.deepEqual(trouble, []);
  assert.deepEqual(requests.filter((url) => !url.startsWith('data:')), [pathToFileURL(index_file).href]);
  assert.match(await page.textContent('h1'), /not as expected/);
});

test('Words find scenarios by name and by text, all of them must occur', async () => {
  await page.fill('#find', 'TRIPOD');
  const tripod = await names();
  assert.ok(tripod.length > 1 && tripod.every((name) => name.startsWith('spr_tripod/')), tripod.join());
  assert.equal(await page.textContent('#shown'), `${tripod.length} of 5 scenarios`);
  await page.fill('#find', 'tripod must_fail');
  assert.ok((await names()).every((name) => name.includes('must_fail')));
  await page.fill('#find', 'no such words');
  assert.deepEqual(await names(), []);
  await page.fill('#find', '');
  assert.equal((await names()).length, 5);
});

test('What failed can be shown alone, with its reason', async () => {
  await page.selectOption('#kind', 'bad');
  const bad = await names();
  assert.equal(bad.length, 1);
  assert.match(bad[0], /wrong_expectation/);
  assert.match(await page.innerText('tbody tr:not([hidden])'), /exit code 0, expected 1/);
  await page.selectOption('#kind', 'good');
  assert.equal((await names()).length, 4);
  await page.selectOption('#kind', '');
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
  assert.equal(walls.length, 5);
  assert.deepEqual(walls, [...walls].sort((a, b) => a - b));
  // Scenarios without an error come last.
  await sortBy('error');
  const errors = await page.$$eval('tbody tr', (rows) => rows.map((row) => row.cells[3].dataset.sort));
  const first_empty = errors.indexOf('');
  assert.ok(first_empty > 0 && errors.slice(first_empty).every((text) => text === ''), errors.join());
  assert.equal(await page.locator('thead th[aria-sort]').count(), 1);
});

test('A second run gives each compared scenario a curve of its past', async () => {
  assert.ok(await page.locator('tbody svg polyline').count() >= 3);
  assert.match(await page.getAttribute('tbody svg', 'aria-label'), /last 2 runs/);
});

test('Every report of the run opens without errors and requests nothing but the night\'s script', async () => {
  const script = fs.readdirSync(night).filter((name) => /^report-[0-9a-f]{16}\.js$/.test(name));
  assert.equal(script.length, 1, 'one for all reports');
  const links = await page.$$eval('tbody a', (all) => all.map((a) => a.getAttribute('href')).filter(
      (href) => href.endsWith('report.html')));
  assert.ok(links.length >= 4, links.join());
  for (const link of links) {
    const file = path.join(night, link);
    const found = {trouble: [], requests: []};
    const report = await openPage(browser, file, found);
    await report.waitForSelector('html[data-ready]', {timeout: 15000});
    const summary = JSON.parse(fs.readFileSync(path.join(path.dirname(file), 'summary.json')));
    const word = {agree: 'Agree', disagree: 'Disagree', not_run: 'Not run'}[summary.verdict];
    assert.ok((await report.innerText('.verdict')).includes(word), link);
    assert.deepEqual(found.trouble, [], link);
    assert.deepEqual(found.requests.filter((url) => !url.startsWith('data:')),
        [file, path.join(night, script[0])].map((name) => pathToFileURL(name).href), link);
    assert.ok(fs.statSync(file).size < 3e6, link);
    await report.close();
  }
});

test('A phone needs no horizontal scrolling of the page', async () => {
  await page.setViewportSize({width: 360, height: 740});
  const {scroll, client} = await page.evaluate(() => ({scroll: document.documentElement.scrollWidth,
                                                       client: document.documentElement.clientWidth}));
  assert.ok(scroll <= client, `${scroll} > ${client}`);
});

test('Nothing went wrong on the way', () => assert.deepEqual(trouble, []));
