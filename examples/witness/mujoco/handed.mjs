// What mbverify hands over (docs/how-to/external_solvers.md): the drives' motion and the loads, at any time.
import fs from 'node:fs';

/** {header, rows}: a CSV file of mbverify's, cells as text. */
function table(file) {
  const [header, ...rows] = fs.readFileSync(file, 'utf8').trimEnd().split('\n').map((line) => line.split(','));
  return {header, rows};
}

// Quintic Hermite polynomial on [0, h] through value, rate and second derivative at both ends: exact
// there, and of sixth order between. Returns the three at s h.
function quintic(a, b, h, s) {
  const [p0, v0, a0] = [a[0], a[1] * h, a[2] * h * h], [p1, v1, a1] = [b[0], b[1] * h, b[2] * h * h];
  const d = p1 - p0 - v0 - a0 / 2, e = v1 - v0 - a0, f = a1 - a0;
  const c3 = 10 * d - 4 * e + f / 2, c4 = -15 * d + 7 * e - f, c5 = 6 * d - 3 * e + f / 2;
  return [
    p0 + s * (v0 + s * (a0 / 2 + s * (c3 + s * (c4 + s * c5)))),
    (v0 + s * (a0 + s * (3 * c3 + s * (4 * c4 + s * 5 * c5)))) / h,
    (a0 + s * (6 * c3 + s * (12 * c4 + s * 20 * c5))) / (h * h),
  ];
}

/** motion.csv: {times, names, at(i, s)}; at() gives {name: [position, velocity, acceleration]} at the
 * share s of the way from sample i to the next. */
export function readMotion(file = 'motion.csv') {
  const {header, rows} = table(file);
  const numbers = rows.map((row) => row.map(Number));
  const names = header.slice(1).filter((_, k) => k % 3 === 0).map((column) => column.replace(/\.position$/, ''));
  const sample = (i, k) => numbers[i].slice(1 + 3 * k, 4 + 3 * k);
  return {
    times: numbers.map((row) => row[0]),
    names,
    at: (i, s) => names.map((_, k) => s === 0 ? sample(i, k) : quintic(
        sample(i, k), sample(i + 1, k), numbers[i + 1][0] - numbers[i][0], s)),
  };
}

/** loads.csv: {bodies, at(i, s)}; at() gives [{body, point, axes, force, moment}], between samples by
 * straight lines. */
export function readLoads(samples, file = 'loads.csv') {
  const {rows} = table(file);
  const each = rows.length / samples;
  const load = (row) => ({
    body: row[2], point: row.slice(3, 6).map(Number), axes: row[6],
    force: row.slice(7, 10).map(Number), moment: row.slice(10, 13).map(Number),
  });
  const loads = rows.map(load);
  const between = (a, b, s) => a.map((value, k) => value + s * (b[k] - value));
  return {
    bodies: [...new Set(loads.map((one) => one.body))],
    at: (i, s) => loads.slice(i * each, (i + 1) * each).map((one, k) => {
      const next = s === 0 ? one : loads[(i + 1) * each + k];
      return {...one, force: between(one.force, next.force, s), moment: between(one.moment, next.moment, s)};
    }),
  };
}
