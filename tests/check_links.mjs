// Links between documents resolve: files, pictures and headings (#…) of README.md, docs/ and models/.
// Prose is at most 100 columns wide.
//   node check_links.mjs ROOT
import { existsSync, readdirSync, readFileSync } from 'node:fs';
import { dirname, join, normalize } from 'node:path';

const kColumns = 100;

// Text without code: blocks between fences, and words in backquotes.
function prose(text) {
  return text.replace(/^ *```[^]*?^ *```$/gm, '').replace(/`[^`\n]*`/g, 'code');
}

// GitHub's name of a heading.
function anchorsIn(text) {
  return text.replace(/^ *```[^]*?^ *```$/gm, '').split('\n').filter((line) => /^#+ /.test(line))
      .map((line) => line.replace(/^#+ /, '').toLowerCase().replace(/[^\p{L}\p{N} _-]/gu, '').replace(/ /g, '-'));
}

// pages: {path: text}; exists: whether a path from the root is there.
function broken(pages, exists) {
  const found = [];
  for (const [page, text] of Object.entries(pages)) {
    let code = false;
    text.split('\n').forEach((line, i) => {
      if (/^ *```/.test(line)) code = !code;
      const free = code || /^ *(\||!\[|<!--)/.test(line) || /results\/|CHANGELOG/.test(page) || !/\S \S/.test(line.slice(0, 100).trim());
      if (!free && [...line].length > kColumns) found.push(`${page}:${i + 1}: ${[...line].length} columns`);
    });
    for (const [, target] of prose(text).matchAll(/\]\(([^)\s]+)\)/g)) {
      if (/^[a-z]+:/.test(target)) continue;
      const [file, anchor] = target.split('#');
      const path = file === '' ? page : normalize(join(dirname(page), file));
      if (!exists(path)) {
        found.push(`${page}: there is no ${target}`);
      } else if (anchor !== undefined && path in pages && !anchorsIn(pages[path]).includes(anchor)) {
        found.push(`${page}: no heading ${target}`);
      }
    }
  }
  return found;
}

// The check itself must be able to fail.
const planted = {
  'docs/a.md': '[b](sub/b.md#two-words) [up](../README.md) [web](https://x.org/y) `[no](code.md)`\n' +
      '```sh\n[no](fence.md)\n```\n[gone](b.md) [head](sub/b.md#three) ![p](p.png)\n' +
      `${'wide '.repeat(21)}\n| ${'wide '.repeat(30)}|`,
  'docs/sub/b.md': '# Two words\n',
};
const wanted = ['docs/a.md:6: 105 columns', 'docs/a.md: there is no b.md', 'docs/a.md: no heading sub/b.md#three', 'docs/a.md: there is no p.png'];
const self = broken(planted, (path) => path in planted || path === 'README.md');
if (self.join() !== wanted.join()) {
  console.log(`check_links: the self-test wanted '${wanted}', found '${self}'`);
  process.exit(1);
}

const root = process.argv[2];
const below = (folder) => readdirSync(join(root, folder), { recursive: true })
    .filter((name) => name.endsWith('.md')).map((name) => join(folder, name));
const pages = Object.fromEntries(['README.md', 'CHANGELOG.md', ...below('docs'), ...below('models')]
    .map((path) => [path, readFileSync(join(root, path), 'utf8')]));
const found = broken(pages, (path) => existsSync(join(root, path)));
console.log(found.length > 0 ? found.join('\n') : `the links of ${Object.keys(pages).length} documents resolve`);
process.exit(found.length > 0 ? 1 : 0);
