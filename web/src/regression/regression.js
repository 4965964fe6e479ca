// Brings index.html of a regression run to life: its table is filtered, sorted, and reached by address.
import './regression.css';

import {fromHash, kUsual, rowOf, toHash} from './address.js';
import {compare, fits, sortValue, wordsOf} from './rows.js';

const table = /** @type {HTMLTableElement} */ (document.querySelector('table'));
const body = table.tBodies[0];
const find = /** @type {HTMLInputElement} */ (document.getElementById('find'));
const kind = /** @type {HTMLSelectElement} */ (document.getElementById('kind'));
const shown = /** @type {HTMLElement} */ (document.getElementById('shown'));
const heads = /** @type {HTMLTableCellElement[]} */ (
    [...table.querySelectorAll('thead th[data-key]')]);
const kinds = [...kind.options].map((option) => option.value);
const keys = heads.map((head) => head.dataset.key ?? '');
const rows = [...body.rows].map((node) => (
    {node, text: (node.textContent ?? '').toLowerCase(), kind: node.dataset.kind ?? '',
     mustFail: 'mustFail' in node.dataset}));

let {key, up} = kUsual;
let typing = false;  // the words typed so far are one step of the way back

function filter() {
  const words = wordsOf(find.value);
  let count = 0;
  for (const row of rows) {
    row.node.hidden = !fits(row, words, kind.value);
    if (!row.node.hidden) ++count;
  }
  shown.textContent = `${count} of ${rows.length} scenarios`;
}

function sort() {
  const head = heads[keys.indexOf(key)];
  for (const other of heads) other.removeAttribute('aria-sort');
  head.setAttribute('aria-sort', up ? 'ascending' : 'descending');
  const sorted = rows.map(({node}) => {
    const cell = node.cells[head.cellIndex];
    return {node, value: sortValue(cell.dataset.sort, cell.textContent ?? '')};
  }).sort((a, b) => compare(a.value, b.value, up));
  body.append(...sorted.map(({node}) => node));
}

/** @param {boolean} push a new step of the way back */
function writeAddress(push) {
  const hash = toHash({find: find.value, show: kind.value, key, up});
  if (hash === (location.hash || '#')) return;
  if (push) history.pushState(null, '', hash);
  else history.replaceState(null, '', hash);
}

/** @param {HTMLElement} row */
function goTo(row) {
  if (row.hidden) {
    find.value = kind.value = '';
    filter();
  }
  row.scrollIntoView();
}

function readAddress() {
  const row = document.getElementById(rowOf(location.hash));
  if (row) {
    goTo(row);
    return;
  }
  const state = fromHash(location.hash, kinds, keys);
  find.value = state.find;
  kind.value = state.show;
  ({key, up} = state);
  filter();
  sort();
}

find.addEventListener('input', () => {
  filter();
  writeAddress(!typing);
  typing = true;
});
find.addEventListener('change', () => { typing = false; });
kind.addEventListener('change', () => {
  filter();
  writeAddress(true);
});
kind.form?.addEventListener('submit', (event) => event.preventDefault());
heads.forEach((head, i) => head.querySelector('button')?.addEventListener('click', () => {
  up = !(key === keys[i] && up);
  key = keys[i];
  sort();
  writeAddress(true);
}));
addEventListener('popstate', () => {
  typing = false;
  readAddress();
});
filter();
sort();
readAddress();
