// A generated model in MuJoCo as it is: equalities prescribed along the drives' motion, their forces read.
import {compile, indicesOf, Refused} from './engine.mjs';
import {leastSolution} from './algebra.mjs';

export const EQUALITY_DATA = 11;  // numbers of eq_data for each equality
const CLOSED = 1e-13;      // to which loops are closed at the start, of the largest coordinate
const STEEPEST = 0.9999;   // the stiffest impedance that MuJoCo takes
const AT_REST = 1e-9;      // rates that are none [rad/s, m/s]
const WALK = 40;           // steps from home to the first sample

export class Simulation {
  /** Compiles MJCF that mbverify wrote; `names`: of what is prescribed. */
  constructor(engine, xml, names) {
    const {mj} = engine;
    const {model, messages} = compile(engine, xml);
    model.opt.jacobian = mj.mjtJacobian.mjJAC_DENSE.value;  // rows are read
    Object.assign(this, {engine, mj, model, messages, data: new mj.MjData(model)});
    this.equalities = indicesOf(engine, model, mj.mjtObj.mjOBJ_EQUALITY, model.neq);
    this.prescribed = names.map((name) => this.equalityOf(name));
  }

  // The residual of a prescribed row is its coordinate − home − eq_data[0].
  equalityOf(name) {
    const id = this.equalities[`drive:${name}`] ?? this.equalities[`base:${name}`];
    if (id === undefined) throw new Refused(`the model has no equality that prescribes ${name}`);
    const {mj, model} = this, object = model.eq_obj1id[id], prescribed = `base:${name}` in this.equalities;
    const tendon = model.eq_type[id] === mj.mjtEq.mjEQ_TENDON.value;
    const home = tendon ? model.tendon_length0[object] : model.qpos0[model.jnt_qposadr[object]];
    return {name, id, home, prescribed};
  }

  setTargets(values) {
    this.prescribed.forEach((one, k) => { this.model.eq_data[EQUALITY_DATA * one.id] = values[k] - one.home; });
  }

  /** Softness of all equalities: as MuJoCo has it unasked, or as stiff as it takes for this step. */
  setSoftness(stiff) {
    const {model} = this, h = model.opt.timestep;
    this.constant = stiff ? 2 * h : 0.02;
    for (let i = 0; i < model.neq; i++) {
      model.eq_solref.set([this.constant, 1], 2 * i);
      model.eq_solimp.set(stiff ? [STEEPEST, STEEPEST, 0.001, 0.5, 2] : [0.9, 0.95, 0.001, 0.5, 2], 5 * i);
    }
  }

  /** Targets that carry rates: MuJoCo's row asks for −b J q̇ − k d (x − target); the target is moved so
   * that this is the commanded acceleration where position and velocity are as commanded. */
  targetsWithRates(motion) {
    const d = STEEPEST, tc = this.constant, b = 2 / (d * tc), k_d = 1 / (d * tc * tc);
    return motion.map(([x, v, a]) => x + (b * v + a) / k_d);
  }

  /** Rows of the equalities at the present position: {pos, J}. */
  rows() {
    const {mj, model, data} = this;
    mj.mj_fwdPosition(model, data);
    const J = data.efc_J, nv = model.nv;
    return {
      pos: Array.from(data.efc_pos.slice(0, data.ne)),
      J: Array.from({length: data.ne}, (_, r) => J.slice(r * nv, (r + 1) * nv)),
    };
  }

  /** Newton to these targets from where the data is; false if it does not arrive. */
  close(targets) {
    this.setTargets(targets);
    for (let i = 0; i < 30; i++) {
      const {pos, J} = this.rows();
      const size = Math.max(1, ...Array.from(this.data.qpos, Math.abs));
      if (Math.max(0, ...pos.map(Math.abs)) <= CLOSED * size) return true;
      const step = leastSolution(J, pos.map((r) => -r));
      if (!step.every(Number.isFinite)) return false;
      const qpos = this.mj.DoubleBuffer.FromArray(Array.from(this.data.qpos));
      this.mj.mj_integratePos(this.model, qpos, Array.from(step), 1);
      this.data.qpos.set(qpos.GetView());
      qpos.delete();
    }
    const gap = Math.max(0, ...this.rows().pos.map(Math.abs));
    return gap <= 1e3 * CLOSED * Math.max(1, ...Array.from(this.data.qpos, Math.abs));
  }

  /** From home to the first sample: closed, and with its velocity. */
  start(motion) {
    for (let n = 1; n <= WALK; n++) {
      const targets = this.prescribed.map((one, k) => one.home + n / WALK * (motion[k][0] - one.home));
      if (!this.close(targets)) throw new Refused('the loops do not close at the first sample');
    }
    const {J} = this.rows();
    const rates = new Array(J.length).fill(0);
    this.prescribed.forEach((one, k) => { rates[this.rowOf(one)] = motion[k][1]; });
    this.data.qvel.set(leastSolution(J, rates));
  }

  rowOf(one) {
    const {mj, data} = this, equality = mj.mjtConstraint.mjCNSTR_EQUALITY.value;
    const types = data.efc_type, ids = data.efc_id;
    for (let row = 0; row < data.ne; row++) {
      if (types[row] === equality && ids[row] === one.id) return row;
    }
    throw new Refused(`${one.name} has no row`);
  }

  /** Loads at the bodies' present poses, as forces at their centres of mass. */
  applyLoads(loads) {
    const {model, data, mj} = this;
    this.bodies ??= indicesOf(this.engine, model, mj.mjtObj.mjOBJ_BODY, model.nbody);
    data.xfrc_applied.fill(0);
    for (const load of loads) {
      const id = this.bodies[load.body], R = data.xmat.slice(9 * id, 9 * id + 9);
      const turned = (v) => [0, 1, 2].map((r) => R[3 * r] * v[0] + R[3 * r + 1] * v[1] + R[3 * r + 2] * v[2]);
      const [force, moment] = load.axes === 'body' ? [turned(load.force), turned(load.moment)] : [load.force, load.moment];
      const place = turned(load.point), centre = data.xipos, origin = data.xpos;
      const arm = place.map((value, k) => value + origin[3 * id + k] - centre[3 * id + k]);
      const torque = [0, 1, 2].map((k) => moment[k] + arm[(k + 1) % 3] * force[(k + 2) % 3] - arm[(k + 2) % 3] * force[(k + 1) % 3]);
      [...force, ...torque].forEach((value, k) => { data.xfrc_applied[6 * id + k] += value; });
    }
  }

  /** Takes dry friction of hinges and slides, elements of mechanism.json. */
  takeFriction(elements) {
    const {mj, model} = this;
    this.friction = elements.map(({on, law}) => {
      const id = mj.mj_name2id(model, mj.mjtObj.mjOBJ_JOINT.value, on.joint);
      const turns = id >= 0 && [mj.mjtJoint.mjJNT_HINGE.value, mj.mjtJoint.mjJNT_SLIDE.value].includes(model.jnt_type[id]);
      if (!turns) throw new Refused(`dry friction acts on ${on.joint}, which is no hinge or slide of the model`);
      return {law, dof: model.jnt_dofadr[id]};
    });
  }

  /** Its forces at the present rates; none at rest, where it may be anything within its band. */
  applyFriction() {
    this.data.qfrc_applied.fill(0);
    for (const {law, dof} of this.friction ?? []) {
      const rate = this.data.qvel[dof], slow = law.stribeck_rate > 0 ? Math.exp(-((rate / law.stribeck_rate) ** 2)) : 0;
      if (Math.abs(rate) > AT_REST) this.data.qfrc_applied[dof] -= Math.sign(rate) * (law.coulomb + (law.breakaway - law.coulomb) * slow);
    }
  }

  /** Position, velocity, acceleration and force of what is prescribed, after mj_forward. */
  driven() {
    const {model, data} = this, nv = model.nv;
    return this.prescribed.map((one) => {
      const row = this.rowOf(one), J = data.efc_J.slice(row * nv, (row + 1) * nv);
      const along = (v) => J.reduce((sum, value, i) => sum + value * v[i], 0);
      const position = data.efc_pos[row] + one.home + model.eq_data[EQUALITY_DATA * one.id];
      return {prescribed: one.prescribed, position, velocity: along(data.qvel), acceleration: along(data.qacc), force: data.efc_force[row]};
    });
  }

  /** The largest distance of the two sides of a loop closure [m]. */
  gap() {
    const {mj, model, data} = this, closes = new Set();
    for (const [name, id] of Object.entries(this.equalities)) if (name.startsWith('close:')) closes.add(id);
    const connect = [mj.mjtEq.mjEQ_CONNECT.value, mj.mjtEq.mjEQ_WELD.value];
    let largest = 0;
    for (let row = 0; row < data.ne;) {
      const id = data.efc_id[row];
      let rows = 1;
      while (row + rows < data.ne && data.efc_id[row + rows] === id) rows++;
      if (closes.has(id) && connect.includes(model.eq_type[id])) {
        largest = Math.max(largest, Math.hypot(...data.efc_pos.slice(row, row + 3)));
      }
      row += rows;
    }
    return largest;
  }
}
