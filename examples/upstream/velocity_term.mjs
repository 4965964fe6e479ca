// MuJoCo leaves the velocity term of tendon and polynomial joint equalities out: a minimal proof.
//
//   MBV_MUJOCO_PACKAGE=node_modules/@mujoco/mujoco node velocity_term.mjs
//
// A unit mass goes round a unit circle at unit speed, without gravity. Whatever holds it there, its
// radial acceleration is −1 m/s². Three files say so by a connect, by a tendon of fixed length, and by
// x = 1 − y²/2, the circle near (1, 0) as a polynomial joint equality.
import {fileURLToPath} from 'node:url';

import {compile, load} from '../witness/mujoco/engine.mjs';

const HEAD = `<mujoco><option timestep="0.0001" gravity="0 0 0" jacobian="dense" tolerance="1e-14"/>
<default><equality solref="0.0002 1" solimp="0.9999 0.9999 0.001 0.5 2"/></default>`;
const MASS = `<body name="mass" pos="1 0 0"><inertial pos="0 0 0" mass="1" diaginertia="1e-9 1e-9 1e-9"/>
<joint name="x" type="slide" axis="1 0 0"/><joint name="y" type="slide" axis="0 1 0"/>`;

/** {name: {xml, qvel}}: one file per kind of equality. */
export const CASES = {
  connect: {
    // The mass on a weightless turning arm, joined to it by a connect.
    xml: `${HEAD}<worldbody>${MASS}</body><body name="arm"><inertial pos="0 0 0" mass="1e-9" diaginertia="1e-9 1e-9 1e-9"/>
<joint name="turn" type="hinge" axis="0 0 1"/></body></worldbody>
<equality><connect body1="mass" body2="arm" anchor="0 0 0"/></equality></mujoco>`,
    qvel: [0, 1, 1],
  },
  tendon: {
    xml: `${HEAD}<worldbody><site name="centre"/>${MASS}<site name="end"/></body></worldbody>
<tendon><spatial name="rod"><site site="centre"/><site site="end"/></spatial></tendon>
<equality><tendon tendon1="rod"/></equality></mujoco>`,
    qvel: [0, 1],
  },
  joint: {
    xml: `${HEAD}<worldbody>${MASS}</body></worldbody>
<equality><joint joint1="x" joint2="y" polycoef="0 0 -0.5 0 0"/></equality></mujoco>`,
    qvel: [0, 1],
  },
};

/** The mass' radial acceleration [m/s²] where it passes (1, 0): −1 is right. */
export function radialAcceleration(engine, {xml, qvel}) {
  const {mj} = engine, {model} = compile(engine, xml), data = new mj.MjData(model);
  data.qvel.set(qvel);
  mj.mj_forward(model, data);
  return data.qacc[0];
}

if (process.argv[1] === fileURLToPath(import.meta.url)) {
  const engine = await load(process.argv[1]);
  console.log(`MuJoCo ${engine.version}: radial acceleration of a unit mass on a unit circle at unit speed; right is -1 m/s2`);
  for (const [name, one] of Object.entries(CASES)) {
    console.log(`${name.padEnd(8)} ${radialAcceleration(engine, one).toFixed(6)}`);
  }
}
