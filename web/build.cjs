// Bundles the script and the style of a page and writes them as C++ text:
//   node build.cjs report|regression OUTPUT.cc      (NODE_PATH names the node_modules folder)
'use strict';
const fs = require('node:fs');
const path = require('node:path');
const esbuild = require('esbuild');

// A page: its folder and main file in src/, the header that declares its functions, that of its
// skeleton page.html, and the packages that are bundled with it.
const kPages = {
  report: {header: 'report/page.h', script: 'PageScript', style: 'PageStyle', skeleton: 'PageSkeleton', packages: ['three', 'uplot']},
  regression: {header: 'features/regress/summaries.h', script: 'IndexScript', style: 'IndexStyle', skeleton: 'IndexPage', packages: []},
};

// Literals are joined from pieces that compilers take without complaint.
function literal(text) {
  if (text.includes(')mbv"')) throw new Error('the bundle contains the literal delimiter');
  const pieces = [];
  for (let at = 0; at < text.length; at += 16000) pieces.push(text.slice(at, at + 16000));
  return pieces.map((piece) => `R"mbv(${piece})mbv"`).join('\n');
}

const textFunction = (name, text) => `std::string_view ${name}() {
  static constexpr char kText[] =
${literal(text)};
  return {kText, sizeof kText - 1};
}
`;

// The licences ask for their text in every copy.
function licences(names) {
  const folder = process.env.NODE_PATH.split(path.delimiter)[0];
  const texts = names.map((name) =>
    `${name}\n${fs.readFileSync(path.join(folder, name, 'LICENSE'), 'utf8').trim()}`);
  return texts.length > 0 ? {js: `/*\n${texts.join('\n\n')}\n*/`} : {};
}

function bundle(name) {
  const {outputFiles} = esbuild.buildSync({
    entryPoints: [path.join(__dirname, 'src', name, `${name}.js`)],
    bundle: true,
    nodePaths: process.env.NODE_PATH.split(path.delimiter),
    minify: true,
    charset: 'ascii',
    legalComments: 'none',
    banner: licences(kPages[name].packages),
    target: ['es2020'],
    format: 'iife',
    outdir: 'bundle',
    write: false,
  });
  const ending = (suffix) => outputFiles.find((file) => file.path.endsWith(suffix)).text;
  const [script, style] = [ending('.js'), ending('.css')];
  if (/<\/script/i.test(script) || /<\/style/i.test(style)) {
    throw new Error('the bundle would end its own element');
  }
  return {script, style};
}

const [name, output] = process.argv.slice(2);
const page = kPages[name];
const {script, style} = bundle(name);
fs.writeFileSync(output, `// Made by web/build.cjs.
#include "${page.header}"

namespace mbv {

${textFunction(page.script, script)}
${textFunction(page.style, style)}
${textFunction(page.skeleton, fs.readFileSync(path.join(__dirname, 'src', name, 'page.html'), 'utf8'))}
}  // namespace mbv
`);
console.log(`${name} page: script ${script.length} bytes, style ${style.length} bytes`);
