// mjd_transitionFD of a model at rest: how accelerations follow positions and velocities along the
// given directions of MuJoCo's rates.
import fs from 'node:fs';
import {compile, indicesOf} from './engine.mjs';

const DIFFERENCE = 1e-6;

/** From model.xml and state.json (qpos; directions: rates of MuJoCo's coordinates; motors: forces by
 * name) to derivatives.json: a row per direction. */
export function derivatives(engine) {
  const {mj} = engine;
  const handed = JSON.parse(fs.readFileSync('state.json', 'utf8'));
  const {model} = compile(engine, fs.readFileSync('model.xml', 'utf8'));
  const data = new mj.MjData(model);
  data.qpos.set(handed.qpos);
  const motors = indicesOf(engine, model, mj.mjtObj.mjOBJ_ACTUATOR, model.nu);
  for (const [name, force] of Object.entries(handed.motors)) data.ctrl[motors[name]] = force;
  const nv = model.nv, size = 2 * nv + model.na, h = model.opt.timestep;
  const buffer = mj.DoubleBuffer.FromArray(new Array(size * size).fill(0));
  mj.mjd_transitionFD(model, data, DIFFERENCE, true, buffer, null, null, null);
  const A = Array.from(buffer.GetView());
  buffer.delete();
  // v⁺ = v + h a
  const along = (direction, first, rest) => Array.from({length: nv}, (_, i) => {
    let sum = 0;
    for (let k = 0; k < nv; k++) sum += A[(nv + i) * size + first + k] * direction[k];
    return (sum - (rest ? direction[i] : 0)) / h;
  });
  fs.writeFileSync('derivatives.json', JSON.stringify({
    by_position: handed.directions.map((direction) => along(direction, 0, false)),
    by_velocity: handed.directions.map((direction) => along(direction, nv, true)),
  }));
  return {method: 'mjd_transitionFD'};
}
