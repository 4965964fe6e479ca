// The types of web/src, which its comments declare: node check_types.cjs TSC ROOT PACKAGES
// Exit code 1 if the compiler finds a fault there, or misses one of type_faults/: a check that
// cannot fail says nothing.
'use strict';
const {spawnSync} = require('node:child_process');
const fs = require('node:fs');
const path = require('node:path');

const [tsc, root, packages] = process.argv.slice(2);

// What the compiler says about a project.
function compile(project) {
  const {stdout, stderr, status, error} = spawnSync(tsc, ['-p', project, '--baseUrl', packages, '--pretty', 'false'],
                                    {encoding: 'utf8'});
  if (error) throw error;
  return stdout || (status === 0 ? '' : `${tsc} ended with ${status}\n${stderr}`);
}

// Faults that are not found, and lines that are wrong without being marked.
function misses() {
  const folder = path.join(root, 'tests/web/type_faults');
  const marked = fs.readFileSync(path.join(folder, 'faults.js'), 'utf8').split('\n')
      .flatMap((line, i) => line.includes('  // WRONG: ') ? [i + 1] : []);
  const said = compile(folder);
  const found = [...said.matchAll(/^\S*faults\.js\((\d+),\d+\): error/gm)].map((match) => Number(match[1]));
  return marked.length > 0 && marked.join() === found.join() ? '' :
      `type_faults/faults.js: lines ${marked.join(', ')} are wrong, found were ${found.join(', ')}\n${said}`;
}

const found = compile(path.join(root, 'web')) || misses();
console.log(found || 'web/src keeps its types, and faults are found');
process.exitCode = found ? 1 : 0;
