// How an import is held against the newest MuJoCo: each comparison on a file of known answers, and
// that it fails where the import is slightly wrong.
import assert from 'node:assert/strict';
import fs from 'node:fs';
import os from 'node:os';
import path from 'node:path';
import {test} from 'node:test';
import {fileURLToPath} from 'node:url';

import {compile, load} from '../../examples/witness/mujoco/engine.mjs';
import {checkFile, COMPILED, isWithin, MOVING, quaternion, Robot, rotation, turned} from '../../scripts/robots_newest.mjs';

const engine = await load(fileURLToPath(import.meta.url));

const MASS = 2, CENTRE = 0.3, INERTIA = [0.02, 0.03, 0.01], G = 9.81, HOME = 0.2;
const FILE = `<mujoco><compiler angle="radian"/><worldbody><body name="my arm" pos="0 0 1" gravcomp="0.25">
  <joint name="A" axis="0 1 0" damping="0.4" frictionloss="0.3" armature="0.05" actuatorgravcomp="true"/>
  <inertial pos="0 0 -${CENTRE}" mass="${MASS}" diaginertia="${INERTIA.join(' ')}"/></body></worldbody>
  <actuator><motor name="m" joint="A"/></actuator></mujoco>`;
const IDENTITY = [[1, 0, 0], [0, 1, 0], [0, 0, 1]];

// What an import of it says.
function mechanism(change = {}) {
  const c = Math.cos(HOME), s = Math.sin(HOME);
  return {
    bodies: [
      {name: 'world', mass: 0, centre_of_mass: [0, 0, 0], inertia: IDENTITY, home: {p: [0, 0, 0], R: IDENTITY}},
      {name: 'my_arm', mass: MASS, centre_of_mass: [0, 0, -CENTRE], inertia: INERTIA.map((x, i) => [0, 1, 2].map((j) => (i === j ? x : 0))),
       home: {p: [0, 0, 1], R: [[c, 0, s], [0, 1, 0], [-s, 0, c]]}, ...change},
    ],
    joints: [{name: 'A', kind: 'revolute', home: [HOME, 0, 0], closure: false}],
    couplings: [],
    drives: [{name: 'm', on: {joint: 'A', coordinate: 0}}],
  };
}
const robot = (change) => new Robot(engine, compile(engine, FILE).model, mechanism(change));

// The weight acts in full where the drive exerts the compensation.
const needed = (q, v, a) => (INERTIA[1] + MASS * CENTRE ** 2 + 0.05) * a + 0.4 * v + (v === 0 ? 0 : 0.3 * Math.sign(v)) + MASS * G * CENTRE * Math.sin(q);

test('Masses, centres and inertias agree, and not where one is off by twice the limit', () => {
  const worst = (change) => Object.fromEntries(Object.entries(robot(change).compareBodies()).map(([kind, [value]]) => [kind, value]));
  for (const value of Object.values(worst({}))) assert.ok(value < 1e-14);
  const more = 1 + 2 * COMPILED;
  assert.ok(worst({mass: MASS * more}).mass > COMPILED);
  assert.ok(worst({centre_of_mass: [0, 0, -CENTRE * more]}).centre > COMPILED);
  assert.ok(worst({inertia: mechanism().bodies[1].inertia.map((row) => row.map((x) => x * more))}).inertia > COMPILED);
});

test('Poses agree at home, and not where a body is moved', () => {
  const worst = (change) => { const one = robot(change); one.goHome(); return one.comparePoses()[0]; };
  assert.ok(worst({}) < 1e-15);
  assert.ok(worst({home: {...mechanism().bodies[1].home, p: [0, 2 * COMPILED, 1]}}) > COMPILED);
});

test('Drive forces are those of the closed form, gravity compensation and dry friction included', () => {
  const one = robot();
  one.goHome();
  for (const [q, v, a] of [[HOME, 0, 0], [0.7, 1.3, -2], [-1.1, -0.4, 5]]) {
    const {forces, gap} = one.driveForces([q], [v], [a]);
    assert.ok(Math.abs(forces[0] - needed(q, v, a)) < 1e-13, `${forces} is not ${needed(q, v, a)}`);
    assert.ok(gap < 1e-13);
  }
});

test('A row is within the limits, and not with twice of one', () => {
  const good = {mass: [0, ''], centre: [0, ''], inertia: [0, ''], poses: [0, ''], gravity: 0, moving: 0};
  assert.ok(isWithin(good));
  for (const kind of ['mass', 'centre', 'inertia', 'poses']) assert.ok(!isWithin({...good, [kind]: [2 * COMPILED, 'x']}));
  assert.ok(!isWithin({...good, gravity: 2 * COMPILED}));
  assert.ok(!isWithin({...good, moving: 2 * MOVING}));
  assert.ok(!isWithin({...good, moving: NaN}));
});

test('Quaternions of rotations, any of whose components may be largest', () => {
  for (const q of [[1, 0, 0, 0], [0.1, 0.9, 0.3, -0.2], [0, 0, 1, 0], [-0.2, 0.1, 0.1, 0.95]]) {
    const unit = q.map((x) => x / Math.hypot(...q)), R = rotation(unit);
    rotation(quaternion(R)).flat().forEach((x, i) => assert.ok(Math.abs(x - R.flat()[i]) < 1e-15));
  }
  assert.deepEqual(turned(IDENTITY, [1, 2, 3]), [1, 0, 0, 0, 2, 0, 0, 0, 3]);
});

// Each number of a ball, and of a free joint that loops carry, which mbverify imports as they are.
for (const file of ['ball_wrist.xml', 'free_platform.xml']) {
  test(`Drive forces of ${file} are the newest MuJoCo's, and not with another number in its joint`, {skip: !process.env.MBVERIFY && 'MBVERIFY is not set'}, () => {
    const scratch = fs.mkdtempSync(path.join(os.tmpdir(), 'robots_newest_test'));
    const whole = fileURLToPath(new URL(`robots/${file}`, import.meta.url));
    const check = (change) => checkFile(engine, process.env.MBVERIFY, whole, scratch, change);
    const row = check();
    assert.ok(isWithin(row) && row.moving < 1e-11, JSON.stringify(row));
    assert.deepEqual(row.notes, []);
    for (const number of ['damping', 'armature', 'frictionloss', 'stiffness']) {
      let changed = 0;
      const other = check((text) => text.replace(new RegExp(`(type="(ball|free)"[^>]* ${number}=")([^"]*)`), (_, before, _kind, value) => {
        changed += 1;
        return before + Number(value) * (1 + 1e-3);
      }));
      assert.equal(changed, 1);
      assert.ok(!isWithin(other), `${number}: ${other.moving}`);
    }
    fs.rmSync(scratch, {recursive: true});
  });
}

// A rod off whose line its mass lies, on a base of three slides and a ball: the base is held, and so
// is the spin of the rod, as mbverify has them.
test('Drive forces of a rod that a universal joint keeps from spinning, and not with its mass elsewhere', {skip: !process.env.MBVERIFY && 'MBVERIFY is not set'}, () => {
  const scratch = fs.mkdtempSync(path.join(os.tmpdir(), 'robots_newest_test'));
  const whole = fileURLToPath(new URL('robots/spun_rod.xml', import.meta.url));
  const check = (change) => checkFile(engine, process.env.MBVERIFY, whole, scratch, change);
  const row = check();
  assert.ok(isWithin(row) && row.moving < 1e-11, JSON.stringify(row));
  assert.equal(row.notes.filter((note) => /spin/.test(note)).length, 1);
  const other = check((text) => text.replace('0.15 0.02 0.1', `0.15 ${0.02 * (1 + 1e-3)} 0.1`));
  assert.ok(!isWithin(other) && other.moving > MOVING, JSON.stringify(other));
  fs.rmSync(scratch, {recursive: true});
});

// A lever that follows a crank by a curve. MuJoCo has no velocity term of such equalities.
test('Drive forces of joints on a curve are those of the import, and not with another curvature', {skip: !process.env.MBVERIFY && 'MBVERIFY is not set'}, () => {
  const scratch = fs.mkdtempSync(path.join(os.tmpdir(), 'robots_newest_test'));
  const whole = fileURLToPath(new URL('robots/curved_lever.xml', import.meta.url));
  const check = (change) => checkFile(engine, process.env.MBVERIFY, whole, scratch, change);
  const row = check();
  assert.ok(isWithin(row) && row.moving < 1e-11, JSON.stringify(row));
  assert.deepEqual(row.notes, []);
  for (const [i, text] of [[2, ' 0.6 '], [3, ' -0.4 '], [4, ' 0.3"']]) {
    const other = check((file) => file.replace(text, text.replace(/[\d.-]+/, (a) => Number(a) * (1 + 1e-3))));
    assert.ok(!isWithin(other) && other.moving > MOVING, `coefficient ${i}: ${JSON.stringify(other)}`);
  }
  fs.rmSync(scratch, {recursive: true});
});
