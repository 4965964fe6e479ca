// Bundles the report's script and style and writes them as C++ text:
//   node build.cjs OUTPUT.cc      (NODE_PATH names the node_modules folder)
'use strict';
const fs = require('node:fs');
const path = require('node:path');
const esbuild = require('esbuild');

// Literals are joined from pieces that compilers take without complaint.
function literal(text) {
  if (text.includes(')mbv"')) throw new Error('the bundle contains the literal delimiter');
  const pieces = [];
  for (let at = 0; at < text.length; at += 16000) pieces.push(text.slice(at, at + 16000));
  return pieces.map((piece) => `R"mbv(${piece})mbv"`).join('\n');
}

// The licences ask for their text in every copy.
const packages = process.env.NODE_PATH.split(path.delimiter)[0];
const licences = ['three', 'uplot'].map((name) =>
    `${name}\n${fs.readFileSync(path.join(packages, name, 'LICENSE'), 'utf8').trim()}`);

const bundle = esbuild.buildSync({
  entryPoints: [path.join(__dirname, 'src', 'report.js')],
  bundle: true,
  nodePaths: process.env.NODE_PATH.split(path.delimiter),
  minify: true,
  charset: 'ascii',
  legalComments: 'none',
  banner: {js: `/*\n${licences.join('\n\n')}\n*/`},
  target: ['es2020'],
  format: 'iife',
  outdir: 'bundle',
  write: false,
});
const ending = (suffix) => bundle.outputFiles.find((file) => file.path.endsWith(suffix)).text;
const script = ending('.js');
const style = ending('.css');
if (/<\/script/i.test(script) || /<\/style/i.test(style)) {
  throw new Error('the bundle would end its own element');
}
fs.writeFileSync(process.argv[2], `// Made by web/build.cjs.
#include "report/html_assets.h"

namespace mbv {

std::string_view PageScript() {
  static constexpr char kScript[] =
${literal(script)};
  return {kScript, sizeof kScript - 1};
}

std::string_view PageStyle() {
  static constexpr char kStyle[] =
${literal(style)};
  return {kStyle, sizeof kStyle - 1};
}

}  // namespace mbv
`);
console.log(`report page: script ${script.length} bytes, style ${style.length} bytes`);
