// Messages are for readers: no source decides by the text of one. Findings carry a code with its subject, summaries
// their place and time.
//   node check_messages.mjs ROOT
import { readdirSync, readFileSync } from 'node:fs';
import { join } from 'node:path';

// Texts of other programs, which give nothing else, and of the user: [file, line as written, reason].
const ALLOWED = [
  ['src/simulation/mjcf/foreign.cc', 'const size_t mark = message.find(open, message.find(beyond));', "MuJoCo's compiler reports text alone"],
  ['src/simulation/mjcf/foreign.cc', 'const size_t from = mark + open.size(), to = message.find(close, from);', 'the same'],
  ['src/simulation/mjcf/foreign.cc', 'if (message.find("unrecognized element") == std::string::npos) return {};', 'the same'],
  ['src/model_file/sdf/sdf_import.cc', 'if (said.find(quoted) != std::string::npos) return &place;', 'libsdformat, too'],
];

const SEARCH = '(?:r?find(?:_\\w+)?|starts_with|ends_with|contains|compare)';
// A variable or member that holds a sentence.
const SENTENCE = '\\b(?:\\w+_)?(?:message|messages|reason|why|sentence|hint|trouble|failure|warning|refusal|said|what\\(\\)|caveat\\.text|Text\\(\\))(?:\\(\\))?';
const RULES = [
  new RegExp(`${SENTENCE}\\s*(?:\\.|->)\\s*${SEARCH}\\s*\\(`),
  new RegExp(`${SENTENCE}\\s*[!=]=\\s*(?:"[^"]|std::string\\(|fmt::format)`),
  new RegExp(`\\b(?:std::regex_(?:search|match)|strstr|strn?cmp|Contains)\\s*\\(\\s*(?:\\w+(?:\\.|->))*${SENTENCE}\\s*,`),
  // Words or an option in whatever is searched: find("does not close"), starts_with("--set ").
  new RegExp(`(?:\\.|->)\\s*${SEARCH}\\s*\\(\\s*"(?:[^"]*[a-z] [a-z=]|--[a-z]+ )[^"]*"`),
];

// [{file, line}] where a text decides.
function comparisons(file, text) {
  const found = [];
  const lines = text.split('\n').map((line) => line.replace(/(^|[^:"'])\/\/.*$/, '$1'));
  for (const [i, line] of lines.entries()) {
    // A call may be broken over two lines; what the second holds alone is its own.
    const both = line + (lines[i + 1] ?? '').trim();
    const hit = RULES.some((rule) => rule.test(line) || (rule.test(both) && !rule.test(lines[i + 1] ?? '')));
    if (hit) found.push({ file, number: i + 1, line: line.trim() });
  }
  return found;
}

// Complaints about sources {file: text}, and about permits that nothing needs.
function complaints(sources, allowed) {
  const used = new Set();
  const list = Object.entries(sources).flatMap(([file, text]) => comparisons(file, text)).filter(({ file, line }) => {
    const permit = allowed.findIndex(([where, what]) => where === file && what === line);
    if (permit >= 0) used.add(permit);
    return permit < 0;
  }).map(({ file, number, line }) => `${file}:${number}: decides by the text of a message: ${line}`);
  allowed.forEach(([where, what], i) => {
    if (!used.has(i)) list.push(`${where}: not there any more, take it out of the list: ${what}`);
  });
  return list;
}

// The check itself must be able to fail, at each kind of comparison, and to pass what is none.
const BAD = [
  'const bool open = row->message.find("does not close") != std::string::npos;',
  'const bool unknown = finding->message == "the file: unknown key \'" + value.first + "\'";',
  'const size_t hint = why.find("; ");',
  'const bool has_time = witness.summary.message.find("t = ") != std::string::npos;',
  'if (!finding.file.starts_with("--set ")) continue;',
  'return database.trouble().ends_with("locked");',
  'if (std::string(error.what()).find("unrecognized element") == std::string::npos) return;',
  'if (diagnostics.Text().find(name) != std::string::npos) return;',
  'if (std::regex_search(finding.message, pattern)) return;',
  'if (Contains(row.reason, word)) return;',
  'if (text.find("step is too coarse") == 0) return;',
  'if (finding.hint != "write it") return;',
  'if (summary.message\n        .starts_with(prefix)) return;',
];
const GOOD = [
  'if (message.empty() || why != "") return;', 'summary.message += ": " + reason;', 'row->message = "x == y";',
  'if (key.starts_with("pose.")) return;', 'if (Contains(words, word)) return;  // message.find("a b")',
  'const auto found = metrics.find(reason);', 'reasons.contains(row.reason)',
];
for (const bad of BAD) {
  if (complaints({ 'a.cc': bad }, []).length === 0) {
    console.log(`check_messages: the self-test passes ${bad}`);
    process.exit(1);
  }
}
const [permit] = BAD;
const self = complaints({ 'a.cc': GOOD.join('\n'), 'b.cc': permit }, [['b.cc', permit, 'test'], ['c.cc', permit, 'test']]);
if (self.length !== 1 || !self[0].startsWith('c.cc')) {
  console.log(`check_messages: the self-test wanted c.cc alone, found ${self.join(' | ')}`);
  process.exit(1);
}

const root = process.argv[2];
const sources = Object.fromEntries(readdirSync(join(root, 'src'), { recursive: true })
    .filter((name) => /\.(cc|h|in)$/.test(name)).sort()
    .map((name) => [`src/${name}`, readFileSync(join(root, 'src', name), 'utf8')]));
const found = complaints(sources, ALLOWED);
console.log(found.length > 0 ? found.join('\n') : `${Object.keys(sources).length} sources decide by no message; ${ALLOWED.length} lines read other programs'`);
process.exit(found.length > 0 ? 1 : 0);
