// The layer table of docs/development/architecture.md against CMakeLists.txt and against the includes: nothing
// beyond the table, and no unused permit.
//   node check_layers.mjs ROOT
import { readdirSync, readFileSync } from 'node:fs';
import { join } from 'node:path';

// A library as the table names it: the start of its headers and its CMake target. Eigen and fmt are
// everybody's.
const LIBRARIES = {
  'Boost': { headers: ['boost/'], target: 'Boost::headers' },
  'cairo': { headers: ['cairo'], target: 'PkgConfig::CAIRO' },
  'CLI11': { headers: ['CLI/'], target: 'CLI11::CLI11' },
  'MuJoCo': { headers: ['mujoco/'], target: 'mujoco::mujoco' },
  'HDF5': { headers: ['hdf5.h'], target: 'PkgConfig::HDF5' },
  'matio': { headers: ['matio.h'], target: 'PkgConfig::MATIO' },
  'Pango': { headers: ['pango/'], target: 'PkgConfig::PANGO' },
  'OSMesa': { headers: ['GL/'], target: '${CMAKE_DL_LIBS}' },  // loaded at run time
  'pybind11': { headers: ['pybind11/'], target: 'pybind11::module' },
  'SQLite': { headers: ['sqlite3'], target: 'SQLite::SQLite3' },
  'Assimp': { headers: ['assimp/'], target: 'assimp::assimp' },
  'MPFI': { headers: ['boost/multiprecision/mpfi'], target: 'MPFI::MPFI' },
  'KLU': { headers: ['suitesparse/'], target: 'KLU::KLU' },
  'NLopt': { headers: ['nlopt'], target: 'NLOPT::NLOPT' },
  'libzip': { headers: ['zip.h'], target: 'PkgConfig::LIBZIP' },
  'libpng': { headers: ['png.h'], target: 'PNG::PNG' },
  'muParser': { headers: ['muParser'], target: 'muparser::muparser' },
  'nlohmann-json': { headers: ['nlohmann/'], target: 'nlohmann_json::nlohmann_json' },
  'tinyxml2': { headers: ['tinyxml2'], target: 'tinyxml2::tinyxml2' },
  'urdfdom': { headers: ['urdf'], target: 'PkgConfig::URDFDOM' },
  'valijson': { headers: ['valijson/'], target: 'valijson' },
  'yaml-cpp': { headers: ['yaml-cpp/'], target: 'yaml-cpp' },
  'zlib': { headers: ['zlib'], target: 'ZLIB::ZLIB' },
};
const EVERYBODYS = ['Eigen3::Eigen', 'fmt::fmt'];

// Rows "| `folder` | … | ours | external |" → folder: {ours: {layer: files or null}, external}.
function readTable(text) {
  const layers = {};
  for (const row of text.matchAll(/^\| `([\w/]+)` \|.*\| ([^|]*) \| ?([^|]*) ?\|$/gm)) {
    const ours = {};
    for (const item of row[2].matchAll(/([\w/]+)(?: \(([^)]*)\))?/g)) {
      ours[item[1]] = item[2] ? item[2].replaceAll('`', '').split(/,\s*/) : null;
    }
    const external = row[3].split(',').map((word) => word.trim()).filter((word) => word !== '');
    layers[row[1]] = { ours, external };
  }
  return layers;
}

// mbv_layer(folder … DEPS … LIBS …), mbv_module(the same) → folder: {deps, libs}.
function readCmake(text) {
  const layers = {};
  for (const call of text.replace(/#.*/g, '').matchAll(/mbv_(?:layer|module)\(([^)]*)\)/g)) {
    const [folder, ...words] = call[1].trim().split(/\s+/);
    const lists = { deps: [], libs: [] };
    let into = null;
    for (const word of words) {
      if (word === 'DEPS') into = lists.deps;
      else if (word === 'LIBS') into = lists.libs;
      else if (into) into.push(word);
    }
    layers[folder] = lists;
  }
  return layers;
}

// src/<room>/… or src/features/<product>/…
function roomOf(path) {
  if (path.startsWith('mbverify/')) return 'features/library';  // include/mbverify
  const parts = path.split('/');
  return parts[0] === 'features' && parts.length > 2 ? `features/${parts[1]}` : parts[0];
}

// Every include below src/ as {path, header}; main.cc and program.cc stand above the layers.
function readIncludes(root) {
  const includes = [];
  for (const path of readdirSync(join(root, 'src'), { recursive: true })) {
    if (!/\.(h|cc)$/.test(path) || !path.includes('/')) continue;
    const text = readFileSync(join(root, 'src', path), 'utf8');
    for (const line of text.matchAll(/^\s*#include [<"]([^>"]+)/gm)) {
      includes.push({ path, header: line[1] });
    }
  }
  return includes;
}

function differences(what, wanted, given) {
  return [...wanted.filter((name) => !given.includes(name)).map((name) => `${what} lacks ${name}`),
          ...given.filter((name) => !wanted.includes(name)).map((name) => `${what} has ${name}, the table has not`)];
}

function compareWithCmake(table, cmake) {
  const found = differences('CMakeLists.txt', Object.keys(table), Object.keys(cmake));
  for (const [folder, row] of Object.entries(table)) {
    if (!(folder in cmake)) continue;
    found.push(...differences(`CMakeLists.txt: DEPS of ${folder}`, Object.keys(row.ours), cmake[folder].deps));
    const targets = row.external.filter((name) => name in LIBRARIES).map((name) => LIBRARIES[name].target);
    const given = cmake[folder].libs.filter((name) => !EVERYBODYS.includes(name));
    found.push(...differences(`CMakeLists.txt: LIBS of ${folder}`, targets, given));
  }
  return found;
}

// The table lists layers from the ground up, so that arrows cannot form a ring.
function checkOrder(table) {
  const found = [];
  const below = [];
  for (const [folder, row] of Object.entries(table)) {
    for (const layer of Object.keys(row.ours)) {
      if (!below.includes(layer)) found.push(`docs/development/architecture.md: ${folder} names ${layer}, which does not stand above it in the table`);
    }
    for (const name of row.external) {
      if (!(name in LIBRARIES) && !['Eigen', 'fmt'].includes(name)) found.push(`docs/development/architecture.md: ${folder}: unknown library ${name}`);
    }
    below.push(folder);
  }
  return found;
}

function compareWithIncludes(table, includes) {
  const found = [];
  const used = new Set();
  for (const { path, header } of includes) {
    const folder = roomOf(path);
    const row = table[folder];
    if (!row) {
      found.push(`src/${path}: folder '${folder}' is not in the layer table`);
      continue;
    }
    const target = header.includes('/') ? roomOf(header) : '';
    if (target in table && target !== folder) {
      const files = row.ours[target];
      if (files === undefined) found.push(`src/${path}: ${folder} may not include ${header}`);
      else if (files && !files.includes(path.slice(folder.length + 1))) found.push(`src/${path}: of ${folder} only ${files.join(', ')} may include ${header}`);
      else used.add(`${folder} ${target} ${files ? path.slice(folder.length + 1) : ''}`);
    }
    for (const [name, library] of Object.entries(LIBRARIES)) {
      if (!library.headers.some((start) => header.startsWith(start))) continue;
      if (row.external.includes(name)) used.add(`${folder} ${name}`);
      else found.push(`src/${path}: ${folder} may not include ${header}`);
    }
  }
  for (const [folder, row] of Object.entries(table)) {
    for (const [layer, files] of Object.entries(row.ours)) {
      for (const file of files ?? ['']) {
        if (!used.has(`${folder} ${layer} ${file}`)) found.push(`docs/development/architecture.md: ${file || folder} may include ${layer}, but does not`);
      }
    }
    for (const name of row.external) {
      if (name in LIBRARIES && !used.has(`${folder} ${name}`)) found.push(`docs/development/architecture.md: ${folder} may include ${name}, but does not`);
    }
  }
  return found;
}

function check(architecture, cmakeLists, includes) {
  const table = readTable(architecture);
  return [...checkOrder(table), ...compareWithCmake(table, readCmake(cmakeLists)), ...compareWithIncludes(table, includes)];
}

// The check itself must be able to fail, once in each way, and to pass.
function selfTest() {
  const table = ['| `core` | c | – | Eigen |', '| `maths` | m | core | Boost |',
                 '| `engine` | e | core, maths (`start.cc`) | MuJoCo |'];
  const cmake = 'mbv_layer(core LIBS Eigen3::Eigen)\nmbv_layer(maths DEPS core LIBS Boost::headers)\n' +
                'mbv_layer(engine LIGHT DEPS core maths LIBS mujoco::mujoco)\n';
  const includes = [['maths/m.cc', 'core/c.h'], ['maths/m.cc', 'boost/b.hpp'], ['engine/e.cc', 'core/c.h'],
                    ['engine/start.cc', 'maths/m.h'], ['engine/e.cc', 'mujoco/mujoco.h']]
      .map(([path, header]) => ({ path, header }));
  const run = ({ rows = table, lists = cmake, more = [], without = '' }) =>
      check(rows.join('\n'), lists, [...includes.filter((i) => i.header !== without), ...more]);
  const cases = [
    [{}, []],
    [{ more: [{ path: 'core/c.cc', header: 'engine/e.h' }] }, ['src/core/c.cc: core may not include engine/e.h']],
    [{ more: [{ path: 'maths/m.cc', header: 'mujoco/mujoco.h' }] }, ['src/maths/m.cc: maths may not include mujoco/mujoco.h']],
    [{ more: [{ path: 'engine/e.cc', header: 'maths/m.h' }] }, ['src/engine/e.cc: of engine only start.cc may include maths/m.h']],
    [{ more: [{ path: 'attic/a.cc', header: 'core/c.h' }] }, ["src/attic/a.cc: folder 'attic' is not in the layer table"]],
    [{ without: 'maths/m.h' }, ['docs/development/architecture.md: start.cc may include maths, but does not']],
    [{ without: 'boost/b.hpp' }, ['docs/development/architecture.md: maths may include Boost, but does not']],
    [{ lists: cmake.replace('core maths', 'core') }, ['CMakeLists.txt: DEPS of engine lacks maths']],
    [{ lists: cmake.replace('Boost::headers', 'Boost::headers ZLIB::ZLIB') }, ['CMakeLists.txt: LIBS of maths has ZLIB::ZLIB, the table has not']],
    [{ lists: cmake + 'mbv_layer(attic)' }, ['CMakeLists.txt has attic, the table has not']],
    [{ rows: [table[1], table[0], table[2]] }, ['docs/development/architecture.md: maths names core, which does not stand above it in the table']],
  ];
  for (const [changes, wanted] of cases) {
    const found = run(changes);
    if (JSON.stringify(found) !== JSON.stringify(wanted)) {
      return `check_layers: the self-test wanted ${JSON.stringify(wanted)}, found ${JSON.stringify(found)}`;
    }
  }
  return '';
}

const failure = selfTest();
if (failure) {
  console.log(failure);
  process.exit(1);
}
const root = process.argv[2];
const found = check(readFileSync(join(root, 'docs/development/architecture.md'), 'utf8'),
                    readFileSync(join(root, 'CMakeLists.txt'), 'utf8'), readIncludes(root));
console.log(found.length > 0 ? found.join('\n') : 'table, CMake and includes agree');
process.exit(found.length > 0 ? 1 : 0);
