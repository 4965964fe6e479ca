// Filter and order as the part of the address after "#?", so that they can be sent and the way back
// leads through them. "#case/…" leads to a row instead.

/**
 * `find`: words; `show`: a kind of row, or ""; `key`: the column sorted by, `up`: smallest first.
 * @typedef {{find: string, show: string, key: string, up: boolean}} State
 */

/** @type {Readonly<State>} */
export const kUsual = {find: '', show: '', key: 'result', up: true};

/**
 * "#?find=…&show=…&sort=-error" with what is not as usual, or "#".
 * @param {State} state
 */
export function toHash({find, show, key, up}) {
  const words = new URLSearchParams();
  if (find) words.set('find', find);
  if (show) words.set('show', show);
  if (key !== kUsual.key || up !== kUsual.up) words.set('sort', (up ? '' : '-') + key);
  const text = words.toString();
  return text === '' ? '#' : '#?' + text;
}

/**
 * The state that an address names; unknown kinds and columns are as usual.
 * @param {string} hash
 * @param {string[]} kinds
 * @param {string[]} keys
 * @returns {State}
 */
export function fromHash(hash, kinds, keys) {
  const words = new URLSearchParams(hash.startsWith('#?') ? hash.slice(2) : '');
  const show = words.get('show') ?? '', sort = words.get('sort') ?? '';
  const key = sort.replace(/^-/, '');
  const order = keys.includes(key) ? {key, up: !sort.startsWith('-')} : {key: kUsual.key, up: kUsual.up};
  return {find: words.get('find') ?? '', show: kinds.includes(show) ? show : '', ...order};
}

/**
 * The id of the row that an address leads to, or "".
 * @param {string} hash
 */
export const rowOf = (hash) => hash.startsWith('#?') ? '' : hash.slice(1);
