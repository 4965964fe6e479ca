// The newest MuJoCo, npm's @mujoco/mujoco: found, loaded, and models compiled with all that it says.
import fs from 'node:fs';
import path from 'node:path';
import {fileURLToPath, pathToFileURL} from 'node:url';

const PACKAGE = '@mujoco/mujoco';

/** What this program cannot compute: no fault of anyone. */
export class Refused extends Error {}

// Where packages may lie: named, above this file, beside the program (and in its build folder), and
// where `npm install -g` puts them.
function folders(program) {
  const beside = path.dirname(fs.realpathSync(program));
  const above = [];
  let folder = path.dirname(fileURLToPath(import.meta.url));
  for (; above.at(-1) !== folder; folder = path.dirname(folder)) above.push(folder);
  return [
    ...above, beside, path.join(beside, 'web'), path.join(path.dirname(process.execPath), '..', 'lib'),
    '/usr/local/lib', '/usr/local/share', '/usr/share',
  ].map((where) => path.join(where, 'node_modules', PACKAGE));
}

function findPackage(program) {
  const named = process.env.MBV_MUJOCO_PACKAGE;
  const places = named ? [named] : [...folders(program), path.join('/usr/share/nodejs', PACKAGE)];
  const found = places.find((place) => fs.existsSync(path.join(place, 'mujoco.js')));
  if (!found) {
    throw new Refused(`npm's ${PACKAGE} is not installed` + (named ? ` in ${named}` : ` (npm install -g ${PACKAGE})`));
  }
  return found;
}

/** {mj, version, said}: the bindings, the version, and what MuJoCo prints, as it comes. */
export async function load(program) {
  const said = [];
  const module = await import(pathToFileURL(path.join(findPackage(program), 'mujoco.js')).href);
  const hear = (line) => said.push(String(line).trim());
  const mj = await module.default({print: hear, printErr: hear});
  return {mj, version: mj.mj_versionString(), said};
}

/** {model, messages}: a model of MJCF text, and what MuJoCo says of a file that it accepts. */
export function compile({mj, said}, xml) {
  const before = said.length;
  const spec = mj.parseXMLString(xml);
  const model = mj.mj_compile(spec);
  const messages = said.slice(before);
  for (let i = 0; i < mj.mjs_numWarnings(spec); i++) messages.push(mj.mjs_getWarning(spec, i));
  return {model, messages: [...new Set(messages.filter((line) => line !== ''))]};
}

/** Named objects of a kind: {name: index}. */
export function indicesOf({mj}, model, type, count) {
  const indices = {};
  for (let i = 0; i < count; i++) indices[mj.mj_id2name(model, type.value, i)] = i;
  return indices;
}

/** The text of anything that was thrown; Emscripten throws numbers. */
export function messageOf(engine, error) {
  if (typeof error !== 'number' || !engine) return String(error?.message ?? error);
  return engine.mj.getExceptionMessage(error).join(': ');
}
