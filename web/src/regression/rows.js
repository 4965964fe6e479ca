// Which scenarios are shown, and in which order.

/**
 * What filters ask of a row: its text in lower case, how it ended ("bad", "warn" or "good"), and
 * whether its scenario must fail.
 * @typedef {{text: string, kind: string, mustFail: boolean}} Row
 */

/**
 * The words of a search, in lower case.
 * @param {string} text
 */
export const wordsOf = (text) => text.toLowerCase().split(/\s+/).filter((word) => word !== '');

/**
 * Whether a row holds all the words and is of the kind asked for.
 * @param {Row} row
 * @param {string[]} words
 * @param {string} show a kind, "must_fail", or "" for all
 */
export function fits(row, words, show) {
  const wanted = show === '' || (show === 'must_fail' ? row.mustFail : row.kind === show);
  return wanted && words.every((word) => row.text.includes(word));
}

/**
 * What a cell is sorted by: the number it gives, NaN if it has none to give, else its text.
 * @param {string | undefined} number
 * @param {string} text
 */
export const sortValue = (number, text) =>
    number === undefined ? text : number === '' ? NaN : Number(number);

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
