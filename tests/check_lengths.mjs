// No source of the program is longer than 400 lines: a longer one has more than one subject.
//   node check_lengths.mjs ROOT
import { readdirSync, readFileSync } from 'node:fs';
import { join } from 'node:path';

const LIMIT = 400;

function tooLong(files) {
  return Object.entries(files).flatMap(([name, text]) => {
    const lines = text.split('\n').length - 1;
    return lines > LIMIT ? [`${name}: ${lines} lines, more than ${LIMIT}`] : [];
  });
}

// The check itself must be able to fail.
const self = tooLong({ 'a.cc': 'x\n'.repeat(LIMIT), 'b.cc': 'x\n'.repeat(LIMIT + 1) }).join();
if (self !== `b.cc: ${LIMIT + 1} lines, more than ${LIMIT}`) {
  console.log(`check_lengths: the self-test found '${self}'`);
  process.exit(1);
}

const root = process.argv[2];
const names = readdirSync(join(root, 'src'), { recursive: true }).filter((name) => /\.(cc|h|mjs|js)$/.test(name));
const found = tooLong(Object.fromEntries(names.map((name) => [`src/${name}`, readFileSync(join(root, 'src', name), 'utf8')])));
console.log(found.length > 0 ? found.join('\n') : `none of ${names.length} sources is longer than ${LIMIT} lines`);
process.exit(found.length > 0 || names.length === 0 ? 1 : 0);
