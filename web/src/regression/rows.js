// Which scenarios are shown, in which order and groups. Nothing here needs a browser.

/**
 * One scenario. `order`: its place among all, the worst first; `kind`: how it ended ("bad", "warn"
 * or "good"); `error`, `limit`: NaN where there is none; `course`: log10 of the last errors, oldest
 * first; `notes`: [class, text], of class "li" as a list below the note before; `open`: what was not
 * compared; `files`: 1 report, 2 numbers; `text`: all of its words in lower case, for the search.
 * @typedef {{key: string, model: string, order: number, kind: string, mustFail: boolean,
 *            description: string, word: string, error: number, limit: number, course: number[],
 *            notes: [string, string][], open: string[], wall: number, cpu: number, memory: number,
 *            files: number, text: string}} Row
 */

const kKinds = ['bad', 'warn', 'good'];

/**
 * The rows of the page's data: an array each, with texts that occur again by number.
 * @param {{texts: string[], rows: any[][]}} data
 * @returns {Row[]}
 */
export function readRows({texts, rows}) {
  const number = (/** @type {number | null} */ value) => value ?? NaN;
  return rows.map(([key, description, kind, mustFail, word, error, limit, course, notes, open, wall, cpu, memory, files], order) => {
    /** @type {Omit<Row, 'text'>} */
    const row = {
      key, model: key.split('/')[0], order, kind: kKinds[kind], mustFail: mustFail === 1, description: texts[description],
      word: texts[word], error: number(error), limit: number(limit), course,
      notes: notes.map((/** @type {[string, number]} */ [name, text]) => [name, texts[text]]),
      open: open.map((/** @type {number} */ text) => texts[text]), wall, cpu, memory, files};
    return {...row, text: [row.key, row.description, row.word, ...row.notes.map(([, text]) => text), ...row.open]
        .join(' ').toLowerCase()};
  });
}

/**
 * The words of a search, in lower case.
 * @param {string} text
 */
export const wordsOf = (text) => text.toLowerCase().split(/\s+/).filter((word) => word !== '');

/**
 * Whether a row holds all the words and is of the kind asked for.
 * @param {{text: string, kind: string, mustFail: boolean}} row
 * @param {string[]} words
 * @param {string} show a kind, "must_fail", or "" for all
 */
export function fits(row, words, show) {
  const wanted = show === '' || (show === 'must_fail' ? row.mustFail : row.kind === show);
  return wanted && words.every((word) => row.text.includes(word));
}

/** @type {Record<string, (row: Row) => number | string>} */
const kValues = {
  scenario: (row) => row.key, result: (row) => row.order, error: (row) => row.error, limit: (row) => row.limit,
  wall: (row) => row.wall, cpu: (row) => row.cpu, memory: (row) => row.memory,
};

/**
 * Order of two values of one column, for Array.sort(). What is missing comes last, both ways.
 * @param {number | string} a
 * @param {number | string} b
 * @param {boolean} up
 */
export function compare(a, b, up) {
  const [missingA, missingB] = [Number.isNaN(a), Number.isNaN(b)];
  if (missingA || missingB) return Number(missingA) - Number(missingB);
  const order = a < b ? -1 : a > b ? 1 : 0;
  return up ? order : -order;
}

/**
 * @param {Row[]} rows
 * @param {string} key a column
 * @param {boolean} up
 */
export const sorted = (rows, key, up) =>
    [...rows].sort((a, b) => compare(kValues[key](a), kValues[key](b), up));

/**
 * The rows by model, in the order of each model's first row; models with trouble stay where their
 * worst row puts them.
 * @param {Row[]} rows in their order
 * @returns {{model: string, rows: Row[], counts: Record<string, number>}[]}
 */
export function grouped(rows) {
  /** @type {Map<string, {model: string, rows: Row[], counts: Record<string, number>}>} */
  const groups = new Map();
  for (const row of rows) {
    const group = groups.get(row.model) ?? {model: row.model, rows: [], counts: {bad: 0, warn: 0, good: 0}};
    group.rows.push(row);
    ++group.counts[row.kind];
    groups.set(row.model, group);
  }
  return [...groups.values()];
}

/**
 * "3 scenarios: 2 as expected, 1 not as expected".
 * @param {Record<string, number>} counts
 */
export function countsText({bad, warn, good}) {
  const total = bad + warn + good;
  const parts = [[good, 'as expected'], [warn, 'drifted'], [bad, 'not as expected']].filter(([count]) => count > 0);
  return `${total} scenario${total === 1 ? '' : 's'}: ` + parts.map(([count, word]) => `${count} ${word}`).join(', ');
}

/**
 * A name without anything that an address would encode: where a scenario's row is.
 * @param {string} key
 */
export const idOf = (key) => 'case/' + linkOf(key).replaceAll('%', '~');

/**
 * A relative link to a file: nothing in it is taken as a scheme, a query or a fragment.
 * @param {string} path
 */
export const linkOf = (path) => [...new TextEncoder().encode(path)].map((byte) => {
  const letter = String.fromCharCode(byte);
  return /[A-Za-z0-9._~/-]/.test(letter) ? letter : '%' + byte.toString(16).toUpperCase().padStart(2, '0');
}).join('');
