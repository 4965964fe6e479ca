// The pages of docs/ name files that exist: every path in backquotes below src, tests, docs, …
//   node check_paths.mjs ROOT
import { existsSync, readdirSync, readFileSync } from 'node:fs';
import { join } from 'node:path';

const FOLDERS = 'src|tests|docs|scripts|cmake|examples|starters|web';  // models and scenarios: the user's, too

// Whole paths only: no wildcards, no places for names, no results of runs.
function pathsIn(text) {
  const found = [];
  for (const [, words] of text.matchAll(/`([^`\n]+)`/g)) {
    for (const word of words.split(/[\s,;()]+/)) {
      if (!new RegExp(`^(${FOLDERS})/[\\w./{},-]*$`).test(word) && !/^(?:src|tests)\/[\w./-]+\.\{h$/.test(word)) continue;
      found.push(word.replace(/\.\{h(,cc\})?$/, '.h'));
    }
  }
  return found;
}

function missing(pages, exists) {
  return Object.entries(pages).flatMap(
      ([page, text]) => pathsIn(text).filter((path) => !exists(path)).map((path) => `${page}: there is no ${path}`));
}

// The check itself must be able to fail.
const page = { 'p.md': '`src/a.cc`, `scripts/x --all` and `src/<layer>/`; `src/gone.cc`' };
const wanted = 'p.md: there is no src/gone.cc';
const self = missing(page, (path) => path === 'src/a.cc' || path === 'scripts/x').join();
if (self !== wanted) {
  console.log(`check_paths: the self-test wanted '${wanted}', found '${self}'`);
  process.exit(1);
}

const root = process.argv[2];
const pages = Object.fromEntries(readdirSync(join(root, 'docs'), { recursive: true }).filter((name) => name.endsWith('.md'))
    .map((name) => [`docs/${name}`, readFileSync(join(root, 'docs', name), 'utf8')]));
const found = missing(pages, (path) => existsSync(join(root, path)));
console.log(found.length > 0 ? found.join('\n') : `the ${Object.keys(pages).length} pages name files that exist`);
process.exit(found.length > 0 ? 1 : 0);
