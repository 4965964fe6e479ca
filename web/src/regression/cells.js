// The elements of a scenario's row.
import {idOf, linkOf} from './rows.js';

/** @typedef {import('./rows.js').Row} Row */

/**
 * @param {string} name
 * @param {Record<string, string>} attributes
 * @param {...(Node | string)} children
 */
export function element(name, attributes, ...children) {
  const node = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) node.setAttribute(key, value);
  node.append(...children);
  return node;
}

/** @param {string} name @param {Record<string, string | number>} attributes */
function shape(name, attributes) {
  const node = document.createElementNS('http://www.w3.org/2000/svg', name);
  for (const [key, value] of Object.entries(attributes)) node.setAttribute(key, String(value));
  return node;
}

const kWidth = 120, kHeight = 32, kMargin = 3;     // [px]
const kCurveRoom = 0.5, kLimitRoom = 0.3;          // decades above and below

/**
 * The course of the error on a logarithmic scale, oldest left, with its limit.
 * @param {Row} row
 */
function sparkline({course, limit}) {
  if (course.length < 2) return '';
  const level = limit > 0 ? Math.log10(limit) : NaN;
  const bottom = Math.min(Math.min(...course) - kCurveRoom, (level || Infinity) - kLimitRoom);
  const top = Math.max(Math.max(...course) + kCurveRoom, (level || -Infinity) + kLimitRoom);
  const y = (/** @type {number} */ at) => kMargin + (kHeight - 2 * kMargin) * (top - at) / (top - bottom);
  const x = (/** @type {number} */ i) => kMargin + (kWidth - 2 * kMargin) * i / (course.length - 1);
  const power = (/** @type {number} */ at) => (10 ** at).toExponential(1);
  const svg = shape('svg', {
    width: kWidth, height: kHeight, viewBox: `0 0 ${kWidth} ${kHeight}`, role: 'img',
    'aria-label': `last ${course.length} runs: ${power(Math.min(...course))} to ${power(Math.max(...course))}, ` +
                  `now ${power(course[course.length - 1])}`});
  if (limit > 0) svg.append(shape('path', {class: 'limit', d: `M0 ${y(level).toFixed(1)}H${kWidth}`}));
  const points = course.map((at, i) => `${x(i).toFixed(1)},${y(at).toFixed(1)}`).join(' ');
  svg.append(shape('polyline', {class: 'curve', points}),
             shape('circle', {class: 'now', cx: x(course.length - 1), cy: y(course[course.length - 1]), r: 2.5}));
  return svg;
}

/** @param {Row} row */
function notes({notes: texts, open}) {
  /** @type {Node[]} */
  const nodes = [];
  for (const [name, text] of texts) {
    const last = nodes[nodes.length - 1];
    if (name === 'log') {
      nodes.push(element('details', {}, element('summary', {}, 'last output'), element('pre', {tabindex: '0'}, text)));
    } else if (name !== 'li') {
      nodes.push(element('p', {class: name}, text));
    } else if (last instanceof HTMLUListElement) {
      last.append(element('li', {}, text));
    } else {
      nodes.push(element('ul', {}, element('li', {}, text)));
    }
  }
  if (open.length > 0) {
    nodes.push(element('details', {}, element('summary', {}, `${open.length} not compared`),
                       element('ul', {}, ...open.map((text) => element('li', {}, text)))));
  }
  return nodes;
}

/** @param {number} value @param {string} text @param {string} label */
const number = (value, text, label) => element(
    'td', {class: 'n', 'data-label': label, 'data-sort': Number.isNaN(value) ? '' : String(value)}, text);
const small = (/** @type {number} */ value) => Number.isNaN(value) ? '–' : value.toExponential(1);

/** @param {Row} row */
export function rowOf(row) {
  const link = linkOf(row.key);
  const links = [...row.files & 1 ? [[`${link}/report.html`, 'report']] : [],
                 ...row.files & 2 ? [[`${link}/summary.json`, 'numbers']] : [], [`logs/${link}.txt`, 'log']]
      .flatMap(([href, name]) => [element('a', {href}, name), ' ']);
  const node = element(
      'tr', {class: 'case', id: idOf(row.key), 'data-kind': row.kind},
      element('th', {scope: 'row'}, row.key, element('br', {}), element('span', {class: 'soft'}, row.description),
              element('br', {}), ...links),
      element('td', {class: `word ${row.kind}`, 'data-sort': String(row.order)}, row.word),
      number(row.error, small(row.error), 'error'),
      number(row.limit, Number.isNaN(row.limit) ? '' : small(row.limit), 'limit'),
      element('td', {class: 'course'}, sparkline(row)), element('td', {class: 'notes'}, ...notes(row)),
      number(row.wall, row.wall.toFixed(1), 'wall [s]'), number(row.cpu, row.cpu.toFixed(1), 'CPU [s]'),
      number(row.memory, row.memory.toFixed(0), 'memory [MiB]'));
  if (row.mustFail) node.dataset.mustFail = '';
  return node;
}
