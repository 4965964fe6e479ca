// A headless Chromium (MBV_CHROMIUM) driven by playwright-core (found by NODE_PATH).
'use strict';
const assert = require('node:assert/strict');
const fs = require('node:fs');
const {pathToFileURL} = require('node:url');

const {chromium} = require('playwright-core');

const kFlags = [
  '--no-sandbox', '--use-gl=angle', '--use-angle=swiftshader', '--enable-unsafe-swiftshader',
  '--disable-quic', '--no-first-run', '--disable-background-networking',
  '--disable-component-update', '--disable-sync', '--enable-precise-memory-info',
];

async function launch() {
  const program = process.env.MBV_CHROMIUM;
  assert.ok(program && fs.existsSync(program),
            'no Chromium: install the Debian package chromium (scripts/setup does)');
  return chromium.launch({executablePath: program, args: kFlags});
}

// Opens a file; errors and warnings of the console go to `trouble`, addresses to `requests`.
async function openPage(browser, file, {trouble, requests}) {
  const page = await browser.newPage({viewport: {width: 1280, height: 900}, reducedMotion: 'reduce'});
  page.setDefaultTimeout(120000);  // on a busy machine
  page.on('console', (message) => {
    if (['error', 'warning'].includes(message.type()) && !/GPU stall|GL Driver/.test(message.text())) {
      trouble.push(message.text());
    }
  });
  page.on('pageerror', (error) => trouble.push(String(error)));
  page.on('request', (request) => requests.push(request.url()));
  await page.goto(pathToFileURL(file).href);
  return page;
}

module.exports = {launch, openPage};
