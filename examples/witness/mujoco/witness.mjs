// The witness (docs/how-to/external_solvers.md): drive forces of MuJoCo's newest version as anyone would get them.
import fs from 'node:fs';

import {Refused} from './engine.mjs';
import {readLoads, readMotion} from './handed.mjs';
import {inverse} from './inverse.mjs';
import {Simulation} from './simulation.mjs';

const METHODS = {
  stiff: 'mj_step; equalities as stiff as MuJoCo takes them, rates in the drives\' targets',
  inverse: 'mj_inverse; loops closed by MuJoCo\'s Jacobians, nothing is soft',
  defaults: 'mj_step; equalities of MuJoCo\'s default softness, positions as the drives\' targets',
};
const LEFT_OUT = [{what: 'joint reactions', why: 'only drives, outputs and loops are read out'}];

// Friction that the joint's load does not raise, of a hinge or slide.
const isDry = ({law, on}) => law.coulomb !== undefined && law.coefficient === 0 && law.resists === undefined && on.joint !== undefined && on.coordinate === 0;

// What MuJoCo has no word for, or what the generated model leaves to whoever steps it.
function refuse(mechanism, loads, simulation) {
  const native = (element) => !element.law.carrier && !element.on.bushing && !element.on.spring &&
      (element.kind === 'damping' || element.kind === 'rotor' && element.on.joint ||
       element.kind === 'spring' && element.law.polynomial.length === 1 && element.law.polynomial[0] > 0);
  const strange = mechanism.elements.filter((element) => !native(element) && !isDry(element)).map((element) => element.name);
  if (mechanism.bushings.length > 0) throw new Refused('MuJoCo has no bushings');
  if (strange.length > 0) throw new Refused(`MuJoCo has no force element like ${strange.join(', ')}`);
  const {mj, model} = simulation;
  const missing = loads.bodies.filter((body) => mj.mj_name2id(model, mj.mjtObj.mjOBJ_BODY.value, body) < 0);
  if (missing.length > 0) throw new Refused(`the model has merged ${missing.join(', ')}, which bears a load`);
}

// x, y, z, roll, pitch, yaw of the outputs in their reference frames (R = Rz Ry Rx), by sites that are
// named like them.
function outputPoses(simulation, mechanism) {
  const {mj, model, data} = simulation;
  const site = (name) => mj.mj_name2id(model, mj.mjtObj.mjOBJ_SITE.value, name);
  const body = (name) => name === mechanism.bodies[0].name ? 0 : mj.mj_name2id(model, mj.mjtObj.mjOBJ_BODY.value, name);
  const product = (A, B) => A.map((row) => [0, 1, 2].map((k) => row[0] * B[0][k] + row[1] * B[1][k] + row[2] * B[2][k]));
  const times = (A, v) => A.map((row) => row[0] * v[0] + row[1] * v[1] + row[2] * v[2]);
  const transposed = (A) => [0, 1, 2].map((r) => A.map((row) => row[r]));
  const matrix = (flat, i) => [0, 1, 2].map((r) => Array.from(flat.slice(9 * i + 3 * r, 9 * i + 3 * r + 3)));
  return mechanism.outputs.filter((output) => site(output.name) >= 0 && body(output.reference.body) >= 0).map((output) => ({
    name: output.name,
    read() {
      const s = site(output.name), b = body(output.reference.body), R_WB = matrix(data.xmat, b);
      const R_RW = transposed(product(R_WB, output.reference.R)), at = times(R_WB, output.reference.p);
      const away = [0, 1, 2].map((k) => data.site_xpos[3 * s + k] - data.xpos[3 * b + k] - at[k]);
      const R = product(R_RW, matrix(data.site_xmat, s));
      return [...times(R_RW, away), Math.atan2(R[2][1], R[2][2]), Math.asin(Math.max(-1, Math.min(1, -R[2][0]))), Math.atan2(R[1][0], R[0][0])];
    },
  }));
}

// One sample: forces at the time itself, before the step that leads on.
function record(driven, simulation, outputs, time) {
  const cells = driven.flatMap(
      (one) => one.prescribed ? [one.force] : [one.position, one.velocity, one.acceleration, one.force]);
  const row = [time, ...cells, ...outputs.flatMap((output) => output.read()), simulation.gap()];
  if (!row.every(Number.isFinite)) throw new Refused(`the simulation diverges at t = ${time} s`);
  return row.join(',');
}

// Puts MuJoCo's bodies where loads need them, and applies these.
function load(simulation, loads, i, s) {
  if (loads.bodies.length === 0) return;
  const {mj, model, data} = simulation;
  mj.mj_kinematics(model, data);
  mj.mj_comPos(model, data);
  simulation.applyLoads(loads.at(i, s));
}

function runInverse(simulation, outputs, motion, loads) {
  simulation.start(motion.at(0, 0));
  return motion.times.map((time, i) => {
    simulation.close(motion.at(i, 0).map(([position]) => position));
    load(simulation, loads, i, 0);
    return record(inverse(simulation, motion.at(i, 0)), simulation, outputs, time);
  });
}

function run(simulation, outputs, motion, loads, stiff) {
  const {mj, model, data} = simulation;
  const sample_s = motion.times.length > 1 ? motion.times[1] - motion.times[0] : 0;
  const steps = Math.max(1, Math.ceil(sample_s / model.opt.timestep - 1e-9));
  if (sample_s > 0) model.opt.timestep = sample_s / steps;
  simulation.setSoftness(stiff);
  simulation.start(motion.at(0, 0));
  const lines = [];
  motion.times.forEach((time, i) => {
    for (let n = 0; n < (i + 1 < motion.times.length ? steps : 1); n++) {
      const at = motion.at(i, n / steps);
      simulation.setTargets(stiff ? simulation.targetsWithRates(at) : at.map(([position]) => position));
      load(simulation, loads, i, n / steps);
      simulation.applyFriction();
      if (n === 0) {
        mj.mj_forward(model, data);
        lines.push(record(simulation.driven(), simulation, outputs, time));
      }
      mj.mj_step(model, data);
    }
  });
  return lines;
}

/** Computes in the present folder, by one of METHODS; throws Refused for what it cannot. Returns what
 * stands in witness.json in addition to the program's name. */
export function witness(engine, method) {
  if (fs.existsSync('start.csv')) throw new Refused('free motions are not stepped here');
  const mechanism = JSON.parse(fs.readFileSync('mechanism.json', 'utf8'));
  const motion = readMotion(), loads = readLoads(motion.times.length);
  const simulation = new Simulation(engine, fs.readFileSync('model.xml', 'utf8'), motion.names);
  refuse(mechanism, loads, simulation);
  simulation.takeFriction(mechanism.elements.filter(isDry));
  const outputs = outputPoses(simulation, mechanism);
  const begun = process.cpuUsage();
  const lines = method === 'inverse' ? runInverse(simulation, outputs, motion, loads) :
                                       run(simulation, outputs, motion, loads, method === 'stiff');
  const used = process.cpuUsage(begun), compute_s = (used.user + used.system) / 1e6;
  const named = (names, words) => names.flatMap((name) => words.map((word) => `${name}.${word}`));
  const columns = [
    ...simulation.prescribed.flatMap(
        (one) => named([one.name], one.prescribed ? ['force'] : ['position', 'velocity', 'acceleration', 'force'])),
    ...named(outputs.map((output) => output.name), ['x', 'y', 'z', 'roll', 'pitch', 'yaw']),
  ];
  fs.writeFileSync('traces.csv', [['time_s', ...columns, 'closure.position'].join(','), ...lines, ''].join('\n'));
  return {method: METHODS[method], compute_s, declined: LEFT_OUT};
}
