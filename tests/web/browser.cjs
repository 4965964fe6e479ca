// A headless Chromium (MBV_CHROMIUM) driven by playwright-core (found by NODE_PATH).
'use strict';
const assert = require('node:assert/strict');
const fs = require('node:fs');
const os = require('node:os');
const path = require('node:path');
const {pathToFileURL} = require('node:url');

const {chromium} = require('playwright-core');

const kFlags = [
  '--no-sandbox', '--use-gl=angle', '--use-angle=swiftshader', '--enable-unsafe-swiftshader',
  // WebGL by software; all else is faster without it.
  '--disable-accelerated-2d-canvas', '--disable-gpu-rasterization', '--disable-quic',
  '--no-first-run', '--disable-background-networking', '--disable-component-update',
  '--disable-sync', '--enable-precise-memory-info',
];
const kPatience_ms = 300000;  // for what must happen, on a busy machine

const threads = new WeakMap();  // by page: the session that reports what its thread has computed

async function launch() {
  const program = process.env.MBV_CHROMIUM;
  assert.ok(program && fs.existsSync(program),
            'no Chromium: install the Debian package chromium (scripts/setup --tests does)');
  return chromium.launch({executablePath: program, args: kFlags, timeout: kPatience_ms});
}

// Opens a file; errors and warnings of the console go to `trouble`, addresses to `requests`.
async function openPage(browser, file, {trouble, requests}) {
  const page = await browser.newPage({viewport: {width: 1280, height: 900}, reducedMotion: 'reduce'});
  page.setDefaultTimeout(kPatience_ms);
  page.on('console', (message) => {
    if (['error', 'warning'].includes(message.type()) && !/GPU stall|GL Driver/.test(message.text())) {
      trouble.push(message.text());
    }
  });
  page.on('pageerror', (error) => trouble.push(String(error)));
  page.on('request', (request) => requests.push(request.url()));
  const session = await page.context().newCDPSession(page);
  await session.send('Performance.enable', {timeDomain: 'threadTicks'});
  threads.set(page, session);
  await page.goto(pathToFileURL(file).href);
  return page;
}

// Waits until the page has drawn itself with what was asked of it before.
const settled = (page) => page.evaluate(() => new Promise((done) => {
  requestAnimationFrame(() => requestAnimationFrame(done));
}));

// What a function of the page says of the pixels of an element: {data (four bytes each), width, height}.
async function measurePixels(page, selector, measure) {
  const picture = await page.locator(selector).first().screenshot();
  const pixels = await page.evaluateHandle(async (png) => {
    const image = new Image();
    image.src = 'data:image/png;base64,' + png;
    await image.decode();
    const canvas = document.createElement('canvas');
    [canvas.width, canvas.height] = [image.width, image.height];
    const context = canvas.getContext('2d');
    context.drawImage(image, 0, 0);
    return context.getImageData(0, 0, image.width, image.height);
  }, picture.toString('base64'));
  return page.evaluate(measure, pixels);
}

// The page learns of its window's size a little later than the browser.
async function resize(page, width, height) {
  await page.setViewportSize({width, height});
  await page.waitForFunction(([w, h]) => innerWidth === w && innerHeight === h, [width, height]);
  await settled(page);
}

// Whether fewer tasks than processors want to run, and this one gets the time that it asks for.
function idleMachine() {
  if (os.loadavg()[0] >= os.cpus().length) return false;
  const start = process.hrtime.bigint(), cpu = process.cpuUsage();
  let used_us = 0;
  while (used_us < 50000) {
    const {user, system} = process.cpuUsage(cpu);
    used_us = user + system;
  }
  return Number(process.hrtime.bigint() - start) / 1000 < 1.2 * used_us;
}

// How long the page took to get ready [ms]; on a busy machine, how long its thread has computed.
async function readyTime(page) {
  const idle = idleMachine();
  await page.waitForSelector('html[data-ready]');
  const ready_ms = Number(await page.getAttribute('html', 'data-ready'));
  if (idle && idleMachine()) return ready_ms;
  const {metrics} = await threads.get(page).send('Performance.getMetrics');
  return Math.min(ready_ms, 1000 * metrics.find(({name}) => name === 'TaskDuration').value);
}

function pagesBelow(folder) {
  return fs.readdirSync(folder, {withFileTypes: true, recursive: true})
      .filter((entry) => entry.isFile() && ['report.html', 'index.html'].includes(entry.name))
      .map((entry) => path.join(entry.parentPath ?? entry.path, entry.name)).sort();
}

// Prints what faultsOf(browser, file) finds in each report.html and index.html below a folder, then
// how many pages are as `promise` says. The process ends with 1 if there is any fault or no page.
async function gate(folder, faultsOf, promise) {
  const pages = pagesBelow(folder);
  if (pages.length === 0) console.error(`no page below ${folder}`);
  const browser = await launch();
  let failed = 0;
  for (const [done, file] of pages.entries()) {
    if (done % 20 === 0 && done > 0) console.error(`${done} of ${pages.length} pages opened`);
    const faults = await faultsOf(browser, file);
    if (faults.length) ++failed;
    for (const fault of faults) console.error(`${path.relative(folder, file)}: ${fault}`);
  }
  await browser.close();
  console.log(`${pages.length - failed} of ${pages.length} pages ${promise}`);
  process.exitCode = failed || pages.length === 0 ? 1 : 0;
}

module.exports = {gate, kPatience_ms, launch, measurePixels, openPage, readyTime, resize, settled};
