// The words of the field in code, messages, pages and documents: none of those below, which readers
// would have to translate (docs/development/contributing.md, "Words").
//   node check_words.mjs ROOT
import { readdirSync, readFileSync, statSync } from 'node:fs';
import { join } from 'node:path';

// What is refused, and what to say.
const WORDS = [
  [/\b(?:told|tells|untold)\b/i, 'reported, reports, returns, shows'],
  [/\b(?:bends?|bent)\b|\bBend(?:able|Search)?\b|kBent/, 'perturbs, perturbed; deforms (of a beam)'],
  [/\bmend(?:s|ed|ing)?\b/i, 'corrects, corrected'],
  [/\brub(?:s|bing|bed)?\b|Rubs\(/i, 'has friction, friction'],
  [/\bOwn(?:File|Run|Model)\w*|\bown_(?:file|model|run)\b/, 'source model'],
  [/\b(?:led|pushers?)\b/, 'actuated by, driven, prescribed'],
  [/\b(?:stranger|nobody|somebody|people)\b/i, 'untrusted input; none, no witness; the list is empty'],
  [/[a-z](?:Nobody|Somebody)[A-Z]|\b(?:Nobody|Somebody)[A-Z]/, 'none, no witness, a third party'],
  [/[A-Za-z](?:Told|Led|Mend(?:s|ed)?|Rubs?|Nights?|People|Bends?|Bent|(?<!Degrees?Of)Freedoms?)(?![a-z])/, 'the words above, also within a name'],
  [/\bbesides\b/i, 'in addition, also'],
  [/\b(?<!every )nights?\b/i, 'regression run'],
  [/\b(?!DOF)freedoms\b/i, 'degrees of freedom'],
  [/\bcame apart\b|\bmoves freely there\b/i, 'loop-closure error of …; singular configuration, uncontrolled'],
  [/\bconcessions?\b/i, 'waiver'],
  [/\bdoubts?\b/i, 'caveat, warning'],
  [/\bsightings?\b/i, 'detection'],
  // The key "declined" of the witness protocol and of reports stays.
  [/(?<!["`])\bdeclin(?:e|es|ed|ing)\b(?!["`:])/i, 'is not applicable: reason'],
  [/\bis none of\b/i, 'is not one of'],
  [/\bis no number\b/i, 'is not a number'],
  [/\bso many\b/i, 'number of …, this many'],
  [/\bothers than\b/i, 'other than'],
  [/\bone's own\b|\bof your own\b/i, 'user-defined, custom, external'],
];
// Where a word means something else: file and text of the line.
const ALLOWED = [
  ['CHANGELOG.md', '`mended` is'],
  ['CHANGELOG.md', '`reservations`'],
];
const ENDINGS = /\.(?:cc|h|py|m|mjs|cjs|js|md|yaml|html|css|in|cmake|txt|sh|json)$/;
const FOLDERS = ['src', 'tests', 'include', 'web/src', 'docs', 'examples', 'models', 'scenarios', 'starters', 'scripts'];
// Tables of public robots, and templates of other programs.
const LEFT_OUT = /^docs\/results\/robots|node_modules|^tests\/check_words/;

function complaints(sources, allowed = []) {
  const found = [];
  for (const [path, text] of Object.entries(sources)) {
    for (const [i, line] of text.split('\n').entries()) {
      if (allowed.some(([file, part]) => file === path && line.includes(part))) continue;
      for (const [word, instead] of WORDS) {
        const match = word.exec(line);
        if (match) found.push(`${path}:${i + 1}: '${match[0]}': say ${instead}`);
      }
    }
  }
  return found;
}

// The check itself must be able to fail.
const planted = { 'a.md': 'What nobody records\nis left out\n', 'b.cc': 'struct OwnFileRun;', 'c.cc': 'bending of a beam',
                  'd.cc': 'TEST(Ranks, OfManyFreedoms)', 'f.cc': 'double kBend', 'e.cc': 'TEST(Ranks, OfManyDegreesOfFreedom)' };
const self = complaints(planted).map((line) => line.split(':').slice(0, 2).join(':')).join(' ');
if (self !== 'a.md:1 b.cc:1 d.cc:1 f.cc:1' || complaints(planted, [['a.md', 'nobody']]).length !== 3) {
  console.log(`check_words: the self-test wanted a.md:1 b.cc:1 d.cc:1 f.cc:1, found ${self}`);
  process.exit(1);
}

const root = process.argv[2];
const names = FOLDERS.flatMap((folder) => readdirSync(join(root, folder), { recursive: true }).map((name) => join(folder, name)));
const sources = Object.fromEntries([...names, 'README.md', 'CHANGELOG.md'].filter((name) => ENDINGS.test(name) && !LEFT_OUT.test(name))
    .filter((name) => statSync(join(root, name)).isFile()).sort()
    .map((name) => [name, readFileSync(join(root, name), 'utf8')]));
const found = complaints(sources, ALLOWED);
console.log(found.length > 0 ? found.join('\n') : `${Object.keys(sources).length} files use the words of the field`);
process.exit(found.length > 0 ? 1 : 0);
