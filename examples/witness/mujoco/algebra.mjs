// Least solutions of J x = b with dense J of any rank.

const dot = (a, b) => {
  let sum = 0;
  for (let i = 0; i < a.length; i++) sum += a[i] * b[i];
  return sum;
};

/** A row is dependent where this share of it, or less, stands out of the rows before it. A row that is
 * this share of the largest, or less, is round-off of zero. */
const DEPENDENT = 1e-9;

/** {row, size, b}: the rows that are not zero, with their right-hand sides. */
export function rowsToUse(J, b = []) {
  const rows = J.map((row, i) => ({row: Float64Array.from(row), b: b[i], size: Math.sqrt(dot(row, row))}));
  const largest = Math.max(0, ...rows.map((entry) => entry.size));
  return rows.filter((entry) => entry.size > DEPENDENT * largest);
}

/** The x of least norm with J x = b in the rows that are independent: modified Gram-Schmidt on the
 * rows, the one that stands out most first. J: rows of equal length; b: their right-hand sides. */
export function leastSolution(J, b) {
  const rows = rowsToUse(J, b);
  const x = new Float64Array(J.length > 0 ? J[0].length : 0);
  while (rows.length > 0) {
    let best = 0, share = 0;
    rows.forEach((entry, i) => {
      const left = Math.sqrt(dot(entry.row, entry.row)) / entry.size;
      if (left > share) [best, share] = [i, left];
    });
    if (share <= DEPENDENT) break;
    const [pivot] = rows.splice(best, 1);
    const length = Math.sqrt(dot(pivot.row, pivot.row));
    const q = pivot.row.map((value) => value / length), along = pivot.b / length;
    for (let i = 0; i < x.length; i++) x[i] += along * q[i];
    for (const entry of rows) {
      const share_of_q = dot(entry.row, q);
      for (let i = 0; i < q.length; i++) entry.row[i] -= share_of_q * q[i];
      entry.b -= share_of_q * along;
    }
  }
  return x;
}
