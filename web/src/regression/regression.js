// Brings index.html of a regression run to life: its table is drawn by model, filtered, sorted, and
// reached by address.
import './regression.css';

import {fromHash, kUsual, rowOf as rowInAddress, toHash} from './address.js';
import {element, rowOf} from './cells.js';
import {countsText, fits, grouped, idOf, readRows, sorted, wordsOf} from './rows.js';

const kRowsAtOnce = 300;       // drawn; the rest by a button
const kOpenGroups = 100;       // rows of all groups that are open from the start

const data = JSON.parse(document.getElementById('page-data')?.textContent ?? '');
const rows = readRows(data);
const table = /** @type {HTMLTableElement} */ (document.querySelector('table'));
const find = /** @type {HTMLInputElement} */ (document.getElementById('find'));
const kind = /** @type {HTMLSelectElement} */ (document.getElementById('kind'));
const shown = /** @type {HTMLElement} */ (document.getElementById('shown'));
const more = /** @type {HTMLButtonElement} */ (document.getElementById('more'));
const heads = /** @type {HTMLTableCellElement[]} */ (
    [...table.querySelectorAll('thead th[data-key]')]);
const kinds = [...kind.options].map((option) => option.value);
const keys = heads.map((head) => head.dataset.key ?? '');

let {key, up} = kUsual;
let typing = false;  // the words typed so far are one step of the way back
let most = kRowsAtOnce;
/** @type {Map<string, boolean>} models that were folded or unfolded by hand */
const unfolded = new Map();

/** @param {{model: string, rows: any[], counts: Record<string, number>}} group @param {boolean} open */
function groupHead(group, open) {
  const button = element('button', {type: 'button', 'aria-expanded': String(open)}, group.model);
  button.addEventListener('click', () => {
    unfolded.set(group.model, !open);
    draw();
    /** @type {HTMLElement | null} */ (document.getElementById(`model/${group.model}`)?.querySelector('button'))?.focus();
  });
  const picture = data.pictures[group.model];
  const kindOf = group.counts.bad ? 'bad' : group.counts.warn ? 'warn' : 'soft';
  return element('tr', {class: 'group', id: `model/${group.model}`},
                 element('th', {scope: 'rowgroup', colspan: '9'},
                         ...(picture ? [element('img', {src: picture, alt: `A picture of ${group.model}`})] : []),
                         button, ' ', element('span', {class: kindOf}, countsText(group.counts))));
}

function draw() {
  const words = wordsOf(find.value);
  const fitting = rows.filter((row) => fits(row, words, kind.value));
  const head = heads[keys.indexOf(key)];
  for (const other of heads) other.removeAttribute('aria-sort');
  head.setAttribute('aria-sort', up ? 'ascending' : 'descending');
  const inOrder = sorted(fitting, key, up);
  // By numbers all models together; else by model, open where something is to be seen.
  const byModel = key === 'result' || key === 'scenario';
  const groups = byModel ? grouped(inOrder) : [{model: '', rows: inOrder, counts: {bad: 0, warn: 0, good: 0}}];
  const few = fitting.length <= kOpenGroups || words.length > 0 || kind.value !== '';
  let left = most, hidden = 0;
  const bodies = groups.map((group) => {
    const open = unfolded.get(group.model) ?? (few || !byModel || group.counts.bad + group.counts.warn > 0);
    const drawn = open ? group.rows.slice(0, left) : [];
    left -= drawn.length;
    if (open) hidden += group.rows.length - drawn.length;
    return element('tbody', {}, ...(byModel ? [groupHead(group, open)] : []), ...drawn.map(rowOf));
  });
  for (const body of [...table.tBodies]) body.remove();
  table.append(...bodies);
  shown.textContent = `${fitting.length} of ${rows.length} scenarios`;
  more.hidden = hidden === 0;
  more.textContent = `Show ${Math.min(hidden, kRowsAtOnce)} more of ${hidden}`;
}

/** @param {boolean} push a new step of the way back */
function writeAddress(push) {
  const hash = toHash({find: find.value, show: kind.value, key, up});
  if (hash === (location.hash || '#')) return;
  if (push) history.pushState(null, '', hash);
  else history.replaceState(null, '', hash);
}

// The row that an address leads to, drawn if it is not.
/** @param {string} id */
function goTo(id) {
  const row = rows.find((candidate) => idOf(candidate.key) === id);
  if (!row) return false;
  if (!document.getElementById(id)) {
    find.value = kind.value = '';
    ({key, up} = kUsual);
    unfolded.set(row.model, true);
    most = rows.length;
    draw();
  }
  document.querySelector('tr.target')?.classList.remove('target');
  const node = document.getElementById(id);
  node?.classList.add('target');
  node?.scrollIntoView();
  return true;
}

function readAddress() {
  if (goTo(rowInAddress(location.hash))) return;
  const state = fromHash(location.hash, kinds, keys);
  find.value = state.find;
  kind.value = state.show;
  ({key, up} = state);
  most = kRowsAtOnce;
  draw();
}

find.addEventListener('input', () => {
  most = kRowsAtOnce;
  draw();
  writeAddress(!typing);
  typing = true;
});
find.addEventListener('change', () => { typing = false; });
kind.addEventListener('change', () => {
  most = kRowsAtOnce;
  draw();
  writeAddress(true);
});
kind.form?.addEventListener('submit', (event) => event.preventDefault());
more.addEventListener('click', () => {
  most += kRowsAtOnce;
  draw();
});
heads.forEach((head, i) => head.querySelector('button')?.addEventListener('click', () => {
  up = !(key === keys[i] && up);
  key = keys[i];
  most = kRowsAtOnce;
  draw();
  writeAddress(true);
}));
addEventListener('popstate', () => {
  typing = false;
  readAddress();
});
draw();
readAddress();
document.documentElement.dataset.ready = String(Math.round(performance.now()));  // for tests
