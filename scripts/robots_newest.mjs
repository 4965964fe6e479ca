// How MJCF and URDF files are imported, held against the newest MuJoCo (npm's @mujoco/mujoco) on the
// files as they are:
//
//   node scripts/robots_newest.mjs MBVERIFY FOLDER…
//
// mbverify imports every such file below the folders and runs its first motion; the newest MuJoCo
// compiles the original. It reads URDF files as trees, whose root is the world, and without mimics:
// of these the mass of all that moves is compared instead of each body's, as frames without mass
// are parts of other bodies here. Compared are masses, centres of mass and inertias, poses at home, and the
// drive forces at rest at home (gravity) and along the motion. MuJoCo closes the loops itself:
//
//   r(q) = 0, q_d = x;  J q̇ = (0, ẋ);  J q̈ = (−J̇q̇, ẍ)                                         (1)
//
// with the file's equalities r and the drives' coordinates q_d, and τ of mj_inverse without
// constraints is shared out to loops and drives, Jᵀ(λ, F) = τ + friction.                          (2)
//
// Prints a Markdown table. Exit code: 0 all within the limits or explained, 1 otherwise, 77 without
// npm's package.
import {execFileSync} from 'node:child_process';
import fs from 'node:fs';
import os from 'node:os';
import path from 'node:path';
import {pathToFileURL} from 'node:url';

import {leastSolution} from '../examples/witness/mujoco/algebra.mjs';
import {load, messageOf, Refused} from '../examples/witness/mujoco/engine.mjs';
import {equalityBias} from '../examples/witness/mujoco/inverse.mjs';
import {EQUALITY_DATA} from '../examples/witness/mujoco/simulation.mjs';

export const COMPILED = 1e-9, MOVING = 1e-6;  // limits, relative
const STATES = 12;                            // samples of a motion
const AT_REST = 1e-9;                         // rates without dry friction [rad/s, m/s]

const sum = (list) => list.reduce((a, b) => a + b, 0);
const norm = (list) => Math.sqrt(sum(list.map((x) => x * x)));
const dot = (a, b) => sum(a.map((x, i) => x * b[i]));
const minus = (a, b) => a.map((x, i) => x - b[i]);

/** Rows of the rotation of a unit quaternion (w, x, y, z). */
export function rotation([w, x, y, z]) {
  return [
    [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
    [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
    [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
  ];
}

/** R diag(d) Rᵀ, as nine numbers. */
export const turned = (R, d) =>
    [0, 1, 2].flatMap((i) => [0, 1, 2].map((j) => sum(d.map((x, k) => R[i][k] * x * R[j][k]))));

/** A unit quaternion of a rotation's rows. */
export function quaternion(R) {
  const candidates = [
    [1 + R[0][0] + R[1][1] + R[2][2], R[2][1] - R[1][2], R[0][2] - R[2][0], R[1][0] - R[0][1]],
    [R[2][1] - R[1][2], 1 + R[0][0] - R[1][1] - R[2][2], R[0][1] + R[1][0], R[0][2] + R[2][0]],
    [R[0][2] - R[2][0], R[0][1] + R[1][0], 1 - R[0][0] + R[1][1] - R[2][2], R[1][2] + R[2][1]],
    [R[1][0] - R[0][1], R[0][2] + R[2][0], R[1][2] + R[2][1], 1 - R[0][0] - R[1][1] + R[2][2]],
  ];
  const best = candidates.reduce((a, b) => (norm(b) > norm(a) ? b : a)), size = norm(best);
  return best.map((x) => x / size);
}

const times = ([a, b, c, d], [e, f, g, h]) =>
    [a * e - b * f - c * g - d * h, a * f + b * e + c * h - d * g, a * g - b * h + c * e + d * f, a * h + b * g - c * f + d * e];

// Roll, pitch and yaw about fixed axes.
function ofAngles([roll, pitch, yaw]) {
  const about = (axis, angle) => [Math.cos(angle / 2), ...[0, 1, 2].map((i) => (i === axis ? Math.sin(angle / 2) : 0))];
  return times(times(about(2, yaw), about(1, pitch)), about(0, roll));
}

const times3 = (R, x) => R.map((row) => dot(row, x));
const cross = ([a, b, c], [d, e, f]) => [b * f - c * e, c * d - a * f, a * e - b * d];

// As model files write it.
const asWritten = (name) => name.replace(/[^A-Za-z0-9_.-]/g, '_');

/** A robot of the newest MuJoCo beside the mechanism that mbverify made of its file. */
export class Robot {
  constructor({mj}, model, mechanism) {
    const data = new mj.MjData(model);
    Object.assign(this, {mj, model, mechanism, data});
    const {mjtObj, mjtDisableBit: off} = mj;
    const name = (type, id, kind) => {
      const given = mj.mj_id2name(model, type.value, id);  // not a text where there is none
      return given && mj.mj_name2id(model, type.value, given) === id ? asWritten(given) : `${kind}_${id}`;
    };
    const named = (type, count, kind) => Object.fromEntries([...Array(count).keys()].map((id) => [name(type, id, kind), id]));
    this.bodies = named(mjtObj.mjOBJ_BODY, model.nbody, 'body');
    this.joints = named(mjtObj.mjOBJ_JOINT, model.njnt, 'joint');
    // Friction is added here; what the import leaves out of contacts, limits and fluids is off.
    this.constrained = off.mjDSBL_CONTACT.value | off.mjDSBL_LIMIT.value | off.mjDSBL_FRICTIONLOSS.value;
    this.unconstrained = this.constrained | off.mjDSBL_CONSTRAINT.value;
    this.flags = model.opt.disableflags;
    this.frictionless = (this.flags & (off.mjDSBL_FRICTIONLOSS.value | off.mjDSBL_CONSTRAINT.value)) !== 0;
    model.opt.enableflags = 0;
    model.opt.density = model.opt.viscosity = 0;
    if ('jacobian' in model.opt) model.opt.jacobian = mj.mjtJacobian.mjJAC_DENSE.value;
    // Equalities that are loops or couplings there.
    const known = new Set([...mechanism.joints, ...mechanism.couplings].map((one) => one.name));
    this.loose = [...Array(model.neq).keys()].filter((id) => !known.has(this.equalityName(id)));
    this.held = this.heldDofs();
    this.spins = this.heldSpins();
    this.drives = mechanism.drives.map((drive) => this.place(drive));
  }

  equalityName(id) {
    const {mj, model} = this, type = mj.mjtObj.mjOBJ_EQUALITY.value, given = mj.mj_id2name(model, type, id);
    if (given && mj.mj_name2id(model, type, given) === id) return asWritten(given);
    if (model.eq_objtype[id] === mj.mjtObj.mjOBJ_SITE.value) {
      const site = (object) => asWritten(mj.mj_id2name(model, mj.mjtObj.mjOBJ_SITE.value, object));
      return `${site(model.eq_obj1id[id])}_${site(model.eq_obj2id[id])}`;
    }
    return `equality_${id}`;
  }

  // Of joints of a base that are left out: its body is held where they have it.
  heldDofs() {
    const {mj, model, mechanism} = this, type = mj.mjtJoint, dofs = [];
    const sizes = {[type.mjJNT_FREE.value]: 6, [type.mjJNT_BALL.value]: 3};
    for (const [name, id] of Object.entries(this.joints)) {
      const kind = mechanism.joints.find((one) => one.name === name)?.kind ?? 'fixed';
      if (kind !== 'fixed') continue;
      for (let i = 0; i < (sizes[model.jnt_type[id]] ?? 1); i++) dofs.push(model.jnt_dofadr[id] + i);
    }
    return dofs;
  }

  // Balls and connects of rods that are universal joints there: f·m = 0 of an axis f of the one and m
  // of the other body holds the spin of the rod about its own line.
  heldSpins() {
    const {mj, model, mechanism} = this;
    const isBall = (name) => model.jnt_type[this.joints[name]] === mj.mjtJoint.mjJNT_BALL.value;
    return mechanism.joints.filter(({name, kind, closure}) => kind === 'universal' && (closure || isBall(name))).map(({parent, child, axis, axis2}) => ({
      parent: this.bodies[parent.body], f: times3(parent.R, axis), child: this.bodies[child.body], m: times3(child.R, axis2),
    }));
  }

  place(drive) {
    const id = drive.on === undefined ? undefined : this.joints[drive.on.joint];
    if (id === undefined) throw new Refused(`drive '${drive.name}' is on no joint of the file`);
    return {name: drive.name, dof: this.model.jnt_dofadr[id], at: this.model.jnt_qposadr[id]};
  }

  /** Largest differences of masses, centres and inertias, relative, and where: [[value, where], …].
   * What the file fixes to the world exerts no force. */
  compareBodies() {
    const {model} = this, bodies = this.mechanism.bodies.filter((body) => model.body_weldid[this.bodies[body.name] ?? -1] !== 0);
    const total = sum(bodies.map((body) => body.mass)), there = sum(Array.from(model.body_mass).filter((_, id) => model.body_weldid[id] !== 0));
    const worst = {mass: [0, ''], centre: [0, ''], inertia: [0, '']};
    const note = (kind, value, where) => { if (!(value <= worst[kind][0])) worst[kind] = [value, where]; };
    note('mass', Math.abs(there - total) / total, 'in all');
    for (const body of bodies) {
      const id = this.bodies[body.name];
      if (id === undefined) {  // a piece between joints
        if (body.mass !== 0) note('mass', 1, body.name);
        continue;
      }
      const mass = model.body_mass[id], I = turned(rotation(model.body_iquat.slice(4 * id, 4 * id + 4)), Array.from(model.body_inertia.slice(3 * id, 3 * id + 3)));
      if (mass === 0 && body.mass === 0) continue;
      const gyration = Math.sqrt(norm(I) / mass), centre = Array.from(model.body_ipos.slice(3 * id, 3 * id + 3));
      note('mass', Math.abs(mass - body.mass) / mass, body.name);
      note('centre', norm(minus(centre, body.centre_of_mass)) / Math.max(norm(centre), gyration), body.name);
      note('inertia', norm(minus(I, body.inertia.flat())) / norm(I), body.name);
    }
    return worst;
  }

  /** The mass of all that moves, relative, instead: [value, where]. */
  compareMoving() {
    const {model, mechanism} = this, still = new Set(['world']);
    for (let before = 0; before < still.size;) {
      before = still.size;
      for (const joint of mechanism.joints) {
        if (joint.kind === 'fixed' && still.has(joint.parent.body)) still.add(joint.child.body);
      }
    }
    const here = sum(mechanism.bodies.filter((body) => !still.has(body.name)).map((body) => body.mass));
    const there = sum(Array.from(model.body_mass).filter((_, id) => model.body_weldid[id] !== 0));
    return [Math.abs(here - there) / there, 'in all'];
  }

  /** Puts MuJoCo into the mechanism's home pose. */
  goHome() {
    const {mj, model, mechanism, data} = this, type = mj.mjtJoint;
    mj.mj_resetData(model, data);
    const qpos = Array.from(model.qpos0);
    for (const [name, id] of Object.entries(this.joints)) {
      const joint = mechanism.joints.find((one) => one.name === name), at = model.jnt_qposadr[id];
      const isFree = model.jnt_type[id] === type.mjJNT_FREE.value;
      if (!isFree && (joint?.kind ?? 'fixed') === 'fixed') continue;  // held
      const body = this.nameOf(model.jnt_bodyid[id]);
      switch (model.jnt_type[id]) {
        case type.mjJNT_FREE.value: {
          const home = mechanism.bodies.find((one) => one.name === body).home;
          qpos.splice(at, 7, ...home.p, ...quaternion(home.R));
          break;
        }
        case type.mjJNT_BALL.value:
          qpos.splice(at, 4, ...(joint.kind === 'ball' ? times(qpos.slice(at, at + 4), ofAngles(joint.home)) : this.homeTurn(model.jnt_bodyid[id])));
          break;
        default:
          qpos[at] += joint.home[0];
      }
    }
    data.qpos.set(qpos);
    for (const id of this.loose) data.eq_active[id] = 0;
  }

  // The rotation of a body's ball in the home pose.
  homeTurn(body) {
    const {model} = this, home = (id) => this.mechanism.bodies.find((one) => one.name === this.nameOf(id)).home.R;
    const columns = (R) => [0, 1, 2].map((k) => R.map((row) => row[k])), product = (A, B) => A.map((row) => times3(columns(B), row));
    const before = product(home(model.body_parentid[body]), rotation(model.body_quat.slice(4 * body, 4 * body + 4)));
    return quaternion(product(columns(before), home(body)));
  }

  nameOf(body) { return Object.keys(this.bodies).find((name) => this.bodies[name] === body); }

  /** Largest distance of bodies' poses at home, of the robot's size; and where. */
  comparePoses() {
    const {mj, model, mechanism, data} = this;
    mj.mj_kinematics(model, data);
    const size = Math.max(...mechanism.bodies.map((body) => norm(body.home.p)), 1e-3);
    let worst = [0, ''];
    for (const body of mechanism.bodies.slice(1)) {
      const id = this.bodies[body.name];
      if (id === undefined) continue;
      const p = Array.from(data.xpos.slice(3 * id, 3 * id + 3)), R = Array.from(data.xmat.slice(9 * id, 9 * id + 9));
      const apart = Math.max(norm(minus(p, body.home.p)) / size, norm(minus(R, body.home.R.flat())));
      if (!(apart <= worst[0])) worst = [apart, body.name];
    }
    return worst;
  }

  // The axes of a held spin in the world.
  axes({parent, f, child, m}) {
    const turn = (body, x) => times3([0, 3, 6].map((k) => Array.from(this.data.xmat.slice(9 * body + k, 9 * body + k + 3))), x);
    return [turn(parent, f), turn(child, m)];
  }

  // Of a body's angular velocity, three rows.
  turning(body) {
    const {mj, model, data} = this, buffer = new mj.DoubleBuffer(3 * model.nv);
    mj.mj_jacBody(model, data, null, buffer, body);
    const J = Array.from(buffer.GetView());
    buffer.delete();
    return [0, 1, 2].map((k) => J.slice(k * model.nv, (k + 1) * model.nv));
  }

  // Equality rows at the present position, then those that are held and driven.
  rows() {
    const {mj, model, data} = this, nv = model.nv;
    model.opt.disableflags = this.flags | this.constrained;
    mj.mj_fwdPosition(model, data);
    const unit = (dof) => Float64Array.from({length: nv}, (_, i) => (i === dof ? 1 : 0));
    const J = data.efc_J, spins = this.spins.map((spin) => {
      const [f, m] = this.axes(spin), n = cross(m, f), child = this.turning(spin.child), parent = this.turning(spin.parent);
      return {pos: dot(f, m), J: Float64Array.from({length: nv}, (_, i) => sum(n.map((x, k) => x * (child[k][i] - parent[k][i]))))};
    });
    return {
      pos: [...Array.from(data.efc_pos.slice(0, data.ne)), ...this.held.map(() => 0), ...spins.map((row) => row.pos)],
      J: [...Array.from({length: data.ne}, (_, r) => J.slice(r * nv, (r + 1) * nv)),
          ...this.held.map(unit), ...spins.map((row) => row.J), ...this.drives.map((drive) => unit(drive.dof))],
    };
  }

  // J̇q̇ that MuJoCo leaves out of the equality in row r: of q₁ = Σ aᵢ xⁱ, x = q₂ − q₂₀, it is
  // −ẋ² Σ i (i − 1) aᵢ xⁱ⁻².
  curvature(r) {
    const {mj, model, data} = this, id = data.efc_id[r], joint = model.eq_obj2id[id];
    if (model.eq_type[id] !== mj.mjtEq.mjEQ_JOINT.value || joint < 0) return 0;
    const x = data.qpos[model.jnt_qposadr[joint]] - model.qpos0[model.jnt_qposadr[joint]], v = data.qvel[model.jnt_dofadr[joint]];
    return -v * v * sum([2, 3, 4].map((i) => i * (i - 1) * model.eq_data[EQUALITY_DATA * id + i] * x ** (i - 2)));
  }

  // J̇q̇ of rows() but the drives', after mj_forward.
  bias() {
    const {mj, model, data} = this, three = (list, body) => Array.from(list.slice(6 * body, 6 * body + 3));
    const ofLoops = equalityBias(data).map((bias, r) => bias + this.curvature(r));
    data.qacc.fill(0);
    mj.mj_rnePostConstraint(model, data);
    return [...ofLoops, ...this.held.map(() => 0), ...this.spins.map((spin) => {
      const [f, m] = this.axes(spin), {parent, child} = spin, w = [three(data.cvel, parent), three(data.cvel, child)];
      const turned = minus(cross(cross(w[1], m), f), cross(cross(w[0], f), m));
      return dot(minus(three(data.cacc, child), three(data.cacc, parent)), cross(m, f)) + dot(minus(w[1], w[0]), turned);
    })];
  }

  // (1): positions, by Newton's method from where it is.
  close(x) {
    const {mj, model, data} = this;
    for (let i = 0; i < 40; i++) {
      const {pos, J} = this.rows();
      const apart = this.drives.map((drive, k) => data.qpos[drive.at] - model.qpos0[drive.at] - x[k]);
      const gap = [...pos, ...apart];
      const largest = Math.max(0, ...gap.map(Math.abs));
      if (largest < 1e-14) return 0;
      if (i === 39) return largest;
      const step = leastSolution(J, gap.map((value) => -value));
      const qpos = mj.DoubleBuffer.FromArray(Array.from(data.qpos));
      mj.mj_integratePos(model, qpos, Array.from(step), 1);
      data.qpos.set(qpos.GetView());
      qpos.delete();
    }
    return Infinity;
  }

  /** (1), (2): drive forces for drives' positions, rates and accelerations, and the gap left. */
  driveForces(x, rate, acceleration) {
    const {mj, model, data} = this;
    const gap = this.close(x), {J} = this.rows();
    data.qvel.set(leastSolution(J, [...Array(J.length - rate.length).fill(0), ...rate]));
    mj.mj_forward(model, data);
    const qacc = leastSolution(J, [...this.bias().map((value) => -value), ...acceleration]);
    model.opt.disableflags = this.flags | this.unconstrained;
    data.qacc.set(qacc);
    mj.mj_inverse(model, data);
    const tau = Array.from(data.qfrc_inverse, (force, dof) => {
      const loss = this.frictionless ? 0 : model.dof_frictionloss[dof], v = data.qvel[dof];
      return force + (Math.abs(v) < AT_REST ? 0 : loss * Math.sign(v));
    });
    const transposed = tau.map((_, dof) => J.map((row) => row[dof]));
    const forces = leastSolution(transposed, tau).slice(J.length - this.drives.length);
    return {forces: Array.from(forces), gap};
  }
}

// A tetrahedron as STL, in the place of meshes that are not there: they show bodies whose inertia is
// stated.
function tetrahedron() {
  const corners = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], bytes = Buffer.alloc(84 + 4 * 50);
  bytes.writeUInt32LE(4, 80);
  [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]].forEach((face, f) => face.forEach((corner, v) => corners[corner].forEach((x, i) =>
    bytes.writeFloatLE(x, 84 + 50 * f + 12 * (v + 1) + 4 * i))));
  return bytes;
}

const isUrdf = (file) => file.endsWith('.urdf');

/** A URDF file without shapes, every link of which is a body of MuJoCo. */
export const bareUrdf = (text) => text.replace(/<!--[^]*?-->/g, '').replace(/<(visual|collision)\b[^>]*?(\/>|>[^]*?<\/\1>)/g, '')
    .replace(/<robot\b[^>]*>/, (open) => `${open}<mujoco><compiler fusestatic="false" discardvisual="true" balanceinertia="false"/></mujoco>`);

/** Compiles a file with what lies in its folder; `change`: of its text. */
function compileFile({mj}, file, change) {
  const folder = path.dirname(file), vfs = new mj.MjVFS();
  // Contacts may be of bodies of a scene that is another file.
  const text = change(fs.readFileSync(file, 'utf8')).replace(/<contact>[^]*?<\/contact>/g, '');
  const below = /meshdir\s*=\s*["']([^"']*)/.exec(text)?.[1] ?? /assetdir\s*=\s*["']([^"']*)/.exec(text)?.[1] ?? '';
  for (const [, name] of text.matchAll(/<mesh[^>]*\sfile\s*=\s*["']([^"']*\.stl)["']/gi)) {
    const place = path.join(below, name);
    const whole = path.join(folder, place);
    if (!fs.existsSync(whole)) vfs.addBuffer(place, tetrahedron());
    else if (place.startsWith('..')) vfs.addBuffer(place, fs.readFileSync(whole));
  }
  for (const name of fs.readdirSync(folder, {recursive: true})) {
    const whole = path.join(folder, name);
    if (fs.statSync(whole).isFile() && /\.(xml|stl|obj|msh|skn|png)$/i.test(name)) vfs.addBuffer(name, fs.readFileSync(whole));
  }
  const spec = mj.parseXMLString(isUrdf(file) ? bareUrdf(text) : text, vfs);
  return mj.mj_compile(spec, vfs);
}

/** Rows of a trace file: {t, column → numbers}. */
function readTraces(file) {
  const [head, ...lines] = fs.readFileSync(file, 'utf8').trim().split('\n').map((line) => line.split(','));
  return Object.fromEntries(head.map((name, c) => [name, lines.map((line) => Number(line[c]))]));
}

/** What is compared of one file, which the newest MuJoCo reads with a change. */
export function checkFile(engine, program, file, scratch, change = (text) => text) {
  const run = (...words) => execFileSync(program, words, {encoding: 'utf8', stdio: ['ignore', 'pipe', 'ignore'], maxBuffer: 1 << 28});
  const row = {file, notes: []};
  const out = fs.mkdtempSync(path.join(scratch, 'run'));
  try {
    run('run', file, '--out', out, '--no-own-file', '-q');
  } catch (error) {
    if (error.status !== 1) return {...row, refused: 'mbverify does not run it'};
  }
  const find = (name) => fs.readdirSync(out, {recursive: true}).map((one) => path.join(out, one)).find((one) => path.basename(one) === name);
  const setup = find('model.yaml');
  if (!setup || !find('traces.csv')) return {...row, refused: 'mbverify makes no motion of it'};
  const mechanism = JSON.parse(run('model', setup, '--format', 'mechanism'));
  row.notes = [...fs.readFileSync(setup, 'utf8').matchAll(/^ {2}- "?(.*? is left out.*?)"?$/gm)].map((match) => match[1]);
  const robot = new Robot(engine, compileFile(engine, file, change), mechanism);
  if (isUrdf(file) && mechanism.joints.some((joint) => joint.closure)) return {...row, refused: 'MuJoCo reads no loops of URDF files'};
  if (isUrdf(file) && mechanism.couplings.length > 0) return {...row, refused: 'MuJoCo reads no mimics of URDF files'};
  Object.assign(row, isUrdf(file) ? {mass: robot.compareMoving(), centre: [0, ''], inertia: [0, '']} : robot.compareBodies());
  robot.goHome();
  row.poses = robot.comparePoses();
  const counts = {bodies: mechanism.bodies.length - 1, drives: robot.drives.length, closures: mechanism.joints.filter((joint) => joint.closure).length};
  // Rates and accelerations of what moves by forces are not in the traces.
  if (/^ *initial:/m.test(fs.readFileSync(find('first.yaml'), 'utf8'))) return {...row, ...counts, gravity: 0, moving: 0, free: true};
  const trace = readTraces(find('traces.csv')), last = trace.time_s.length - 1;
  // Where friction rests, the force is anywhere in a band: its middle is that without friction.
  const side = (drive, quantity, end) => trace[`${drive.name}.${quantity}.${end}.reference`];
  const column = (drive, quantity) => trace[`${drive.name}.${quantity}.reference`].map(
      (x, i) => (Number.isNaN(x) && quantity === 'force' ? (side(drive, quantity, 'lower')[i] + side(drive, quantity, 'upper')[i]) / 2 : x));
  const at = (quantity, i) => robot.drives.map((drive) => column(drive, quantity)[i]);
  const size = Math.max(...robot.drives.map((drive) => Math.max(...column(drive, 'force').map(Math.abs))));
  const apart = (i) => {
    const {forces, gap} = robot.driveForces(at('position', i), at('velocity', i), at('acceleration', i));
    row.gap = Math.max(row.gap ?? 0, gap);
    return Math.max(...minus(forces, at('force', i)).map(Math.abs)) / size;
  };
  row.gravity = apart(0);
  row.moving = 0;
  for (let k = 1; k <= STATES; k++) row.moving = Math.max(row.moving, apart(Math.round((k * last) / STATES)));
  return {...row, ...counts};
}

/** Whether all that was compared is within its limit. */
export const isWithin = (row) => [row.mass[0], row.centre[0], row.inertia[0], row.poses[0], row.gravity].every((x) => x <= COMPILED) && row.moving <= MOVING;

const small = (x) => (x === 0 ? '0' : x.toExponential(1).replace('e', 'e'));
function line(row, root) {
  const file = path.relative(root, row.file);
  if (row.refused) return `| ${file} | | | | | | | | | ${row.refused} |`;
  const where = ([value, at]) => small(value) + (value > COMPILED ? ` (${at})` : '');
  return `| ${file} | ${row.bodies} | ${row.closures} | ${row.drives} | ${where(row.mass)} | ${where(row.centre)} | ${where(row.inertia)} | ${where(row.poses)} | ${row.free ? 'moves by forces' : small(row.gravity)} | ${row.free ? '' : small(row.moving)} | ${row.notes.join('; ')} |`;
}

async function main([program, ...folders]) {
  let engine;
  try {
    engine = await load(program);
  } catch (error) {
    if (!(error instanceof Refused)) throw error;
    console.error(error.message);
    return 77;
  }
  const scratch = fs.mkdtempSync(path.join(os.tmpdir(), 'robots_newest'));
  let worst = 0;
  console.log(`MuJoCo ${engine.version}\n`);
  console.log('| file | bodies | loops | drives | mass | centre | inertia | poses | gravity | moving | left out, or why not |\n|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|---|');
  for (const folder of folders) {
    const files = fs.statSync(folder).isFile() ? [folder] : fs.readdirSync(folder, {recursive: true}).filter((name) => name.endsWith('.xml') || name.endsWith('.urdf')).sort().map((name) => path.join(folder, name));
    for (const file of files) {
      let row;
      try {
        row = checkFile(engine, program, path.resolve(file), scratch);
      } catch (error) {
        // Folders that a file names are those of its author's machine.
        row = {file, refused: messageOf(engine, error).split('\n')[0].replace(/\/(?:[^/'"\s]+\/)+/g, '').slice(0, 160), notes: []};
      }
      if (!row.refused && !isWithin(row) && row.notes.length === 0) worst = 1;
      console.log(line(row, fs.statSync(folder).isFile() ? path.dirname(folder) : folder));
    }
  }
  fs.rmSync(scratch, {recursive: true});
  return worst;
}

if (import.meta.url === pathToFileURL(process.argv[1]).href) process.exitCode = await main(process.argv.slice(2));
