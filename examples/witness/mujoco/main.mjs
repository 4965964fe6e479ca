// The newest MuJoCo (npm's @mujoco/mujoco, run by Node.js) as a witness:
//
//   mbverify-witness-mujoco              stiff equalities, rates in the drives' targets
//   mbverify-witness-mujoco --inverse    inverse dynamics at each sample, nothing is soft
//   mbverify-witness-mujoco --defaults   MuJoCo's default softness, positions as targets
//   mbverify-witness-mujoco --rows       instead: rows of the model at given states (mbverify crosscheck --newest)
//   mbverify-witness-mujoco --derivatives   instead: mjd_transitionFD at a state (mbverify linearise --mujoco)
//
// mbverify calls it in a folder of its own (docs/how-to/external_solvers.md).
import fs from 'node:fs';

import {derivatives} from './derivatives.mjs';
import {load, messageOf, Refused} from './engine.mjs';
import {rows} from './rows.mjs';
import {witness} from './witness.mjs';

const [, program, ...words] = process.argv;
const answer = {schema: 'mbverify/witness/1', program: 'MuJoCo', version: '', units: 'SI'};
const method = ['inverse', 'defaults'].find((one) => words.includes(`--${one}`)) ?? 'stiff';
let engine;
try {
  engine = await load(program);
  answer.version = engine.version;
  Object.assign(answer, words.includes('--rows')        ? rows(engine) :
                        words.includes('--derivatives') ? derivatives(engine) :
                                                          witness(engine, method));
} catch (error) {
  if (!(error instanceof Refused)) {
    console.error(messageOf(engine, error));
    process.exit(1);
  }
  answer.refused = error.message;
}
fs.writeFileSync('witness.json', JSON.stringify(answer, null, 1));
