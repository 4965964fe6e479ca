// Inverse dynamics of a generated model, with nothing soft: loops and drives exactly as commanded,
//
//   r(q) = 0;  J q̇ = (0, ẋ);  J q̈ = (−J̇q̇, ẍ);  J_loopsᵀ λ + J_drivesᵀ F = τ              (1)
//
// with rows and J̇q̇ of MuJoCo's equalities and τ of mj_inverse without constraints. Where redundant
// drives or loops leave F open, it is the one of least norm.
import {leastSolution, rowsToUse} from './algebra.mjs';
import {Refused} from './engine.mjs';
import {EQUALITY_DATA} from './simulation.mjs';

// A row of the loops is dependent where this share of it stands out of those before it: of planar
// loops it is what positions closed to 1e-13 leave.
const DEPENDENT = 1e-7;

const dot = (a, b) => a.reduce((sum, value, i) => sum + value * b[i], 0);

/** J̇q̇ of the equalities after mj_forward: what their reference acceleration has beside stiffness and
 * damping. */
export function equalityBias(data) {
  return Array.from({length: data.ne}, (_, r) => -data.efc_aref[r] - data.efc_KBIP[4 * r + 1] * data.efc_vel[r] -
      data.efc_KBIP[4 * r] * data.efc_KBIP[4 * r + 2] * data.efc_pos[r]);
}

// An orthonormal basis of what the rows span beside `known`, which is one.
function basisOf(rows, known = []) {
  const left = rowsToUse(rows);
  const remove = (q, entry) => {
    const along = dot(entry.row, q);
    entry.row.forEach((value, i) => { entry.row[i] = value - along * q[i]; });
  };
  for (const q of known) left.forEach((entry) => remove(q, entry));
  const share = (entry) => Math.sqrt(dot(entry.row, entry.row)) / entry.size;
  const basis = [];
  while (left.length > 0) {
    const best = left.reduce((a, _, i) => (share(left[i]) > share(left[a]) ? i : a), 0);
    if (share(left[best]) <= DEPENDENT) break;
    const [{row}] = left.splice(best, 1), length = Math.sqrt(dot(row, row)), q = row.map((value) => value / length);
    basis.push(q);
    left.forEach((entry) => remove(q, entry));
  }
  return basis;
}

// Whose J̇q̇ MuJoCo 3.14 leaves out: lengths of tendons, and couplings that are not linear.
function refuseCurved({mj, model}) {
  const type = mj.mjtEq, isTendon = (id) => model.eq_type[id] === type.mjEQ_TENDON.value;
  const isCurved = (id) => model.eq_type[id] === type.mjEQ_JOINT.value &&
      model.eq_data.slice(EQUALITY_DATA * id + 2, EQUALITY_DATA * id + 5).some((c) => c !== 0);
  for (let id = 0; id < model.neq; id++) {
    if (isTendon(id) || isCurved(id)) throw new Refused('MuJoCo leaves out the velocity term of its tendon and polynomial rows');
  }
}

/** Rows of a trace: what is driven at `motion` ([position, velocity, acceleration] of each), after the
 * sample before; entries as Simulation.driven(). */
export function inverse(simulation, motion) {
  const {mj, model, data, prescribed} = simulation, disable = mj.mjtDisableBit.mjDSBL_CONSTRAINT.value;
  refuseCurved(simulation);
  if (!simulation.close(motion.map(([position]) => position))) throw new Refused('the loops do not close');
  const {J} = simulation.rows(), at = prescribed.map((one) => simulation.rowOf(one));
  const wanted = (values) => values.map((value, r) => (at.includes(r) ? 0 : value));
  const rates = new Array(J.length).fill(0);
  at.forEach((row, k) => { rates[row] = motion[k][1]; });
  data.qvel.set(leastSolution(J, rates));
  simulation.applyFriction();
  mj.mj_forward(model, data);
  // Loads (xfrc_applied, qfrc_applied) are no part of mj_inverse.
  const loads = Array.from(data.qfrc_smooth, (force, i) => force - data.qfrc_passive[i] + data.qfrc_bias[i]);
  const wantedAcceleration = wanted(equalityBias(data).map((value) => -value));
  at.forEach((row, k) => { wantedAcceleration[row] = motion[k][2]; });
  const qacc = leastSolution(J, wantedAcceleration), along = (row, v) => dot(J[row], v);
  model.opt.disableflags |= disable;
  data.qacc.set(qacc);
  mj.mj_inverse(model, data);
  model.opt.disableflags &= ~disable;
  const tau = Array.from(data.qfrc_inverse, (force, i) => force - loads[i]);
  const driven = prescribed.map((one, k) => (one.prescribed ? -1 : at[k])).filter((row) => row >= 0);
  // Where loops bear nothing.
  const units = tau.map((_, dof) => tau.map((_, i) => (i === dof ? 1 : 0)));
  const free = basisOf(units, basisOf(J.filter((_, r) => !driven.includes(r))));
  const forces = leastSolution(free.map((q) => driven.map((row) => dot(J[row], q))), free.map((q) => dot(tau, q)));
  const rest = tau.map((value, dof) => value - driven.reduce((sum, row, k) => sum + J[row][dof] * forces[k], 0));
  const others = J.map((_, r) => r).filter((r) => !driven.includes(r));
  const held = leastSolution(tau.map((_, dof) => others.map((r) => J[r][dof])), rest);
  return prescribed.map((one, k) => ({
    prescribed: one.prescribed,
    position: motion[k][0],
    velocity: along(at[k], data.qvel),
    acceleration: along(at[k], qacc),
    force: one.prescribed ? held[others.indexOf(at[k])] : forces[driven.indexOf(at[k])],
  }));
}
