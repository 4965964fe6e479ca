// The newest MuJoCo (npm's @mujoco/mujoco): that the generated files load there without a message,
// that messages are heard, and what it still leaves out.
import assert from 'node:assert/strict';
import fs from 'node:fs';
import {test} from 'node:test';
import {fileURLToPath} from 'node:url';

import {CASES, radialAcceleration} from '../../examples/upstream/velocity_term.mjs';
import {leastSolution} from '../../examples/witness/mujoco/algebra.mjs';
import {compile, load, messageOf} from '../../examples/witness/mujoco/engine.mjs';
import {inverse} from '../../examples/witness/mujoco/inverse.mjs';
import {Simulation} from '../../examples/witness/mujoco/simulation.mjs';

const models = fileURLToPath(new URL('../../models', import.meta.url));
const engine = await load(fileURLToPath(import.meta.url));

test('The generated files load without a message, and step', () => {
  const files = fs.readdirSync(models).map((name) => `${models}/${name}/${name}.xml`).filter((file) => fs.existsSync(file));
  assert.ok(files.length >= 6, `${files}`);
  for (const file of files) {
    const {model, messages} = compile(engine, fs.readFileSync(file, 'utf8'));
    assert.deepEqual(messages, [], file);
    const data = new engine.mj.MjData(model);
    for (let i = 0; i < 10; i++) engine.mj.mj_step(model, data);
    assert.ok(Array.from(data.qpos).every(Number.isFinite), file);
  }
});

test('A file that it does not take is an error with its message', () => {
  assert.throws(() => compile(engine, '<mujoco><worldbody><body><joint/></body></worldbody></mujoco>'), (error) => {
    assert.match(messageOf(engine, error), /mass|inertia/);
    return true;
  });
});

test('What is said of a file that is taken is heard, printed or listed', () => {
  const said = ['from before'];
  const mj = {
    parseXMLString: (xml) => ({xml}), mj_compile: (spec) => { said.push('printed'); return spec.xml; },
    mjs_numWarnings: () => 2, mjs_getWarning: (_, i) => ['listed', 'printed'][i],
  };
  assert.deepEqual(compile({mj, said}, 'text'), {model: 'text', messages: ['printed', 'listed']});
});

test('Connect rows have their velocity term; tendon and polynomial joint rows still lack it', () => {
  const radial = Object.fromEntries(Object.entries(CASES).map(([name, one]) => [name, radialAcceleration(engine, one)]));
  assert.ok(Math.abs(radial.connect + 1) < 1e-3, `${radial.connect}`);
  assert.ok(Math.abs(radial.tendon) < 1e-9, `${radial.tendon}`);
  assert.ok(Math.abs(radial.joint) < 1e-9, `${radial.joint}`);
});

test('Least solutions: of full rank, of dependent rows, of too few rows', () => {
  const near = (x, y) => x.forEach((value, i) => assert.ok(Math.abs(value - y[i]) < 1e-12, `${x} is not ${y}`));
  near(leastSolution([[2, 0], [1, 1]], [4, 5]), [2, 3]);
  near(leastSolution([[1, 1], [2, 2]], [1, 2]), [0.5, 0.5]);
  near(leastSolution([[3, 4]], [5]), [0.6, 0.8]);
  near(leastSolution([[0, 0], [1, 0]], [0, 7]), [7, 0]);
});

// A bar on a hinge whose end is held on the bar's own circle, driven by one or two drives.
const bar = (drives) => new Simulation(engine, `<mujoco><compiler angle="radian"/><worldbody>
  <body><joint name="A" axis="0 1 0"/><inertial pos="0.5 0 0" mass="2" diaginertia="0.1 0.1 0.1"/>
    <site name="end" pos="1 0 0"/></body></worldbody><tendon/>
  <equality>${drives.map((name) => `<joint name="drive:${name}" joint1="A"/>`).join('')}</equality></mujoco>`, drives);

test('Inverse dynamics: forces as by hand, of redundant drives the least, rows of round-off left out', () => {
  const q = 0.3, v = 0.8, a = -1.7, torque = (0.1 + 2 * 0.25) * a - 2 * 9.81 * 0.5 * Math.cos(q);
  for (const names of [['one'], ['one', 'two']]) {
    const simulation = bar(names), motion = names.map(() => [q, v, a]);
    simulation.start(motion);
    const driven = inverse(simulation, motion);
    for (const one of driven) {
      assert.ok(Math.abs(one.force - torque / names.length) < 1e-10, `${one.force} is not ${torque / names.length}`);
      assert.ok(Math.abs(one.acceleration - a) < 1e-12);
    }
  }
});

test('Dry friction is the drive\'s to overcome: against its rate, slower than Stribeck\'s more, none at rest', () => {
  const q = 0.3, a = -1.7, torque = (0.1 + 2 * 0.25) * a - 2 * 9.81 * 0.5 * Math.cos(q);
  const law = {coulomb: 0.4, breakaway: 0.7, stribeck_rate: 0.5};
  const force = (v, change = {}) => {
    const simulation = bar(['one']);
    simulation.takeFriction([{on: {joint: 'A', coordinate: 0}, law: {...law, ...change}}]);
    simulation.start([[q, v, a]]);
    return inverse(simulation, [[q, v, a]])[0].force;
  };
  for (const v of [0.8, -0.2, 0]) {
    const size = 0.4 + 0.3 * Math.exp(-((v / 0.5) ** 2));
    assert.ok(Math.abs(force(v) - torque - Math.sign(v) * size) < 1e-10, `${v}`);
  }
  assert.ok(Math.abs(force(0.8, {stribeck_rate: 0}) - torque - 0.4) < 1e-10);
  assert.ok(Math.abs(force(0.8, {coulomb: 0.4 * (1 + 1e-6)}) - force(0.8)) > 1e-7);
  assert.throws(() => bar(['one']).takeFriction([{on: {joint: 'nowhere', coordinate: 0}, law}]), /no hinge or slide/);
});

test('Inverse dynamics refuses rows whose velocity term MuJoCo leaves out', () => {
  const simulation = bar(['one']);
  simulation.model.eq_data[2] = 0.5;  // of a quadratic polynomial
  assert.throws(() => inverse(simulation, [[0, 0, 0]]), /velocity term/);
});
