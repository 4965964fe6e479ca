// The pages of docs/ name files that exist: every path in backquotes below src, tests, docs, …
//   node check_paths.mjs ROOT
import { existsSync, readdirSync, readFileSync, statSync } from 'node:fs';
import { join } from 'node:path';

const FOLDERS = 'src|tests|docs|scripts|cmake|examples|starters|web';  // models and scenarios: the user's, too

// Paths as they are printed; of {h,cc} each.
function pathsIn(text) {
  const found = [];
  for (const [, words] of text.matchAll(/`([^`\n]+)`/g)) {
    for (const word of words.split(/[\s;()]+|,(?![^{]*})/)) {
      if (!new RegExp(`^(${FOLDERS})/[\\w./{},<>*-]*$`).test(word)) continue;
      const [, before, each, behind] = word.match(/^([^{]*)\{([^}]*)\}(.*)$/) ?? [];
      found.push(...(each ? each.split(',').map((one) => before + one + behind) : [word]));
    }
  }
  return found;
}

// A place for a name, <name> or *, stands for any.
function exists(folder, path) {
  const [first, ...rest] = path.split('/').filter((part) => part !== '');
  if (first === undefined) return true;
  if (!/[<*]/.test(first)) return existsSync(join(folder, first)) && exists(join(folder, first), rest.join('/'));
  const fits = new RegExp(`^${first.split(/<\w+>|\*+/).map((part) => part.replace(/[.]/g, '\\.')).join('.+')}$`);
  return statSync(folder).isDirectory() && readdirSync(folder).some((name) => fits.test(name) && exists(join(folder, name), rest.join('/')));
}

function missing(pages, exists) {
  return Object.entries(pages).flatMap(
      ([page, text]) => pathsIn(text).filter((path) => !exists(path)).map((path) => `${page}: there is no ${path}`));
}

const root = process.argv[2];

// The check itself must be able to fail.
const page = {
  'p.md': '`src/base/files.{h,gone}`, `scripts/setup --tests`, `src/<layer>/*.cc` and `tests/<name>/<gone>_test.h`; `src/gone.cc`',
};
const wanted = ['src/base/files.gone', 'tests/<name>/<gone>_test.h', 'src/gone.cc'].map((path) => `p.md: there is no ${path}`).join();
const self = missing(page, (path) => exists(root, path)).join();
if (self !== wanted) {
  console.log(`check_paths: the self-test wanted '${wanted}', found '${self}'`);
  process.exit(1);
}

const pages = Object.fromEntries(readdirSync(join(root, 'docs'), { recursive: true }).filter((name) => name.endsWith('.md'))
    .map((name) => [`docs/${name}`, readFileSync(join(root, 'docs', name), 'utf8')]));
const found = missing(pages, (path) => exists(root, path));
console.log(found.length > 0 ? found.join('\n') : `the ${Object.keys(pages).length} pages name files that exist`);
process.exit(found.length > 0 ? 1 : 0);
