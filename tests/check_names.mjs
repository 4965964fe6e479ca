// Sources are compiled several at a time (CMake's unity build): names in unnamed namespaces must
// differ within each library of src/ and tests/, and so must tests; none is a type of a
// header that one of the files includes, and no file opens a namespace for those compiled after it
// (but within a namespace of its room, which all its files share). Types that headers declare differ
// in the whole program.
//   node check_names.mjs ROOT
import { readdirSync, readFileSync } from 'node:fs';
import { join } from 'node:path';

// src/<room>, src/features/<product>, and the same below tests/.
function libraryOf(path) {
  const parts = path.split('/');
  return parts.slice(0, parts[1] === 'features' ? 3 : 2).join('/');
}

// What the lines from `i` on declare at the left margin of an unnamed namespace: {name, shape}, or
// null. Two declarations of one name may live together when both are functions with different
// parameters, or the same alias; their `shape` reports. Forward declarations of types count for
// nothing: the definition follows.
function declared(lines, i) {
  const line = lines[i];
  if (/^(return|using namespace|namespace|TEST|INSTANTIATE|MATCHER|else|#)/.test(line)) return null;
  const alias = /^using (\w+) = (.*)/.exec(line);
  if (alias) return { name: alias[1], shape: `= ${alias[2]}` };
  const patterns = [
    /^(?:template <.*> )?(?:struct|class|enum(?: class)?) (\w+)\b[^;]*\{/,
    /^(?:inline |static )*constexpr [^(]*?(\w+)(?:\[[^\]]*\])*(?:\s*[={]|$)/,
    /^(?:const|static|thread_local) [^(]*?\b(\w+)(?:\[[^\]]*\])*\s*[={]/,
  ];
  for (const pattern of patterns) {
    const match = pattern.exec(line);
    if (match) return { name: match[1], shape: '' };
  }
  const call = /^[A-Za-z][\w:<>,&*\s[\]]*?[\s&*>](\w+)\((.*)/.exec(line);
  if (!call) return null;
  let parameters = call[2];
  for (let next = i + 1; !parameters.includes(')') && next < lines.length; ++next) parameters += lines[next];
  // A literal goes to either of two that take text in different types.
  const types = parameters.split(')')[0].split(',').map((one) => one.trim().replace(/\s*=.*/, '').replace(/\s*\w+$/, '')
      .replace(/^(const char\*|(const )?std::string&?|std::string_view)$/, 'text'));
  return { name: call[1], shape: `(${types.join(', ')})` };
}

// [{name, kind, shape}] of one source: `name` with the namespaces around it.
function namesOf(text) {
  const names = [];
  const around = [];  // open namespaces, '' for unnamed ones
  const lines = text.split('\n');
  for (const [i, line] of lines.entries()) {
    const open = /^(?:inline )?namespace (?:([\w:]+) )?\{$/.exec(line);
    if (open) {
      around.push(open[1] ?? '');
      continue;
    }
    if (/^\}  \/\/ namespace/.test(line)) {
      around.pop();
      continue;
    }
    const outer = around.filter((name) => name !== '').join('::');
    const test = /^TEST(?:_[FP])?\((\w+), (\w+)\)/.exec(line);
    if (test) names.push({ name: `${outer}::${test[1]}.${test[2]}`, kind: 'test' });
    const directive = /^using namespace ([\w:]+);/.exec(line);
    if (directive && (outer === '' || outer === 'mbv')) names.push({ name: directive[1], kind: 'directive' });
    if (!around.includes('')) continue;
    const found = declared(lines, i);
    if (found) names.push({ name: `${outer}::${found.name}`, kind: 'unnamed', shape: found.shape });
  }
  return names;
}

function clash(one, other) {
  if (one.path === other.path) return false;
  const alias = one.shape?.startsWith('=') && one.shape === other.shape;
  const overload = one.shape?.startsWith('(') && other.shape?.startsWith('(') && one.shape !== other.shape;
  return !alias && !overload;
}

// Types that headers declare: "mbv::Load" → header. One that another header declares, too, goes to
// `twice`: whatever the rooms, the linker takes one of both for all.
function typesIn(headers, twice = []) {
  const types = {};
  for (const [path, text] of Object.entries(headers)) {
    let outer = '';
    for (const line of text.split('\n')) {
      const open = /^namespace ([\w:]+) \{$/.exec(line);
      if (open) outer = open[1];
      const type = /^(?:struct|class|enum(?: class)?) (\w+)\b[^;]*\{/.exec(line);
      if (!type) continue;
      const name = `${outer}::${type[1]}`;
      if (name in types && types[name] !== path) twice.push(`${name} is a type of ${types[name]} and of ${path}`);
      types[name] = path;
    }
  }
  return types;
}

// The headers of src/ that a folder's sources reach, by folder.
function reachedHeaders(sources, headers) {
  const includes = (text) => [...text.matchAll(/^#include "([^"]+)"/gm)].map((match) => `src/${match[1]}`);
  const reached = {};
  for (const [path, text] of Object.entries(sources)) {
    const folder = libraryOf(path);
    const seen = (reached[folder] ??= new Set());
    const open = includes(text);
    while (open.length > 0) {
      const header = open.pop();
      if (seen.has(header) || !(header in headers)) continue;
      seen.add(header);
      open.push(...includes(headers[header]));
    }
  }
  return reached;
}

// `sources`: path → text. Only *.cc: headers are guarded. `headers`: whose types an unnamed name
// must leave alone, since files compiled after it may use them.
function check(sources, headers = {}) {
  const places = {};  // folder and name → declarations
  const found = [];
  const types = typesIn(headers, found);
  const reached = reachedHeaders(sources, headers);
  for (const [path, text] of Object.entries(sources)) {
    const folder = libraryOf(path);
    for (const { name, kind, shape } of namesOf(text)) {
      if (kind === 'directive') {
        found.push(`${path}: using namespace ${name} reaches the files compiled after it`);
      } else {
        (places[`${folder} ${name}`] ??= []).push({ path, shape });
        if (kind === 'unnamed' && reached[folder].has(types[name])) found.push(`${path}: ${name} is a type of ${types[name]}`);
      }
    }
  }
  for (const [key, all] of Object.entries(places)) {
    const files = all.filter((one) => all.some((other) => clash(one, other))).map(({ path }) => path);
    if (files.length > 0) found.push(`${key.split(' ')[1]} is in ${[...new Set(files)].join(', ')}`);
  }
  return found;
}

function selfTest() {
  const file = (inside, after = '') => `namespace mbv {\nnamespace {\n\n${inside}\n\n}  // namespace\n${after}\n}  // namespace mbv\n`;
  const both = (inside, after) => check({ 'src/a/x.cc': file(inside, after), 'src/a/y.cc': file(inside, after) });
  const clashing = {
    Twice: 'double Twice(double x) {\n  return 2 * x;\n}', kLimit: 'constexpr double kLimit = 2.0;',
    kTable: 'constexpr JointKind kTable[] = {', Row: 'struct Row {', Columns: 'class Columns final : public Base {',
    Shape: 'enum class Shape { kRound };',     kWords: 'const std::map<int, std::string> kWords = {', Pick: 'template <typename T>\nT Pick(const T& value) {',
  };
  for (const [name, text] of Object.entries(clashing)) {
    const found = both(text).join();
    if (found !== `mbv::${name} is in src/a/x.cc, src/a/y.cc`) return `${name} twice: ${found || 'nothing found'}`;
  }
  if (both('', 'TEST(Sum, Adds) {\n}').join() !== 'mbv::Sum.Adds is in src/a/x.cc, src/a/y.cc') return 'a test twice';
  if (check({ 'tests/a/x.cc': 'using namespace std;\n' }).length !== 1) return 'a using-directive';
  if (check({ 'src/a/x.cc': 'namespace mbv::room {\nusing namespace other;\n' }).length !== 0) return 'a directive within a room';
  const header = { 'src/b/y.h': 'namespace mbv {\nstruct Load {\n};\n' };
  const other = { 'src/a/z.cc': '#include "b/y.h"\n' };
  if (check({ 'src/a/x.cc': file('int Load(int x) {'), ...other }, header).length !== 1) return 'a type of a header';
  if (check({ 'src/a/x.cc': file('int Load(int x) {') }, header).length !== 0) return 'a type without includers';
  const twice = { 'src/a/x.h': 'namespace mbv {\nstruct Load {\n};\n', ...header };
  if (check({}, twice).join() !== 'mbv::Load is a type of src/a/x.h and of src/b/y.h') return 'a type in two headers';
  if (check({}, { 'src/a/x.h': 'namespace mbv::a {\nstruct Load {\n};\n', ...header }).length !== 0) return 'a type in two namespaces';
  const same = file('int Once() {');
  if (check({ 'src/a/x.cc': same, 'src/b/x.cc': same }).length !== 0) return 'one name in two layers';
  if (both('struct Row;\nusing internal::Row;\nusing Json = nlohmann::json;', 'int Shared(int x);').length !== 0) return 'declarations that may occur twice';
  if (check({ 'src/a/x.cc': file('int Of(int x) {'), 'src/a/y.cc': file('int Of(const Row& x,\n       int y) {') }).length !== 0) return 'overloads';
  if (check({ 'src/a/x.cc': file('int Of(const char* x) {'), 'src/a/y.cc': file('int Of(const std::string& x) {') }).length !== 1) return 'texts of different types';
  if (check({ 'src/a/x.cc': file('using Row = int;'), 'src/a/y.cc': file('using Row = double;') }).length !== 1) return 'two aliases';
  return '';
}

const failure = selfTest();
if (failure) {
  console.log(`check_names: the self-test failed: ${failure}`);
  process.exit(1);
}
const root = process.argv[2];
const sources = {}, headers = {};
for (const top of ['src', 'tests']) {
  for (const path of readdirSync(join(root, top), { recursive: true }).sort()) {
    const text = () => readFileSync(join(root, top, path), 'utf8');
    if (/^(fuzz|benchmarks|install)\//.test(path) || !path.includes('/')) continue;
    if (path.endsWith('.cc')) sources[`${top}/${path}`] = text();
    if (top === 'src' && path.endsWith('.h')) headers[`${top}/${path}`] = text();
  }
}
const found = check(sources, headers);
console.log(found.length > 0 ? found.join('\n') : `names differ in ${Object.keys(sources).length} sources`);
process.exit(found.length > 0 ? 1 : 0);
