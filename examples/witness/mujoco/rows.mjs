// Rows of a generated model's equalities at given states: softness, velocity term, forces.
//
// states.json: {"drives": [names], "states": [{"qpos", "qvel", "targets", "applied"}]} with MuJoCo's
// coordinates, what the drives' equalities are to be held at, and generalized forces of all loads. rows.json answers, per row and state,
//   R      the row's softness,
//   bias   what its reference acceleration subtracts in addition to damping and stiffness: J̇q̇, if at all,
//   force  of the drives, by mj_forward there.
import fs from 'node:fs';

import {Simulation} from './simulation.mjs';

const KBIP = 4;  // stiffness, damping, impedance and its slope of each row

function at(simulation, state) {
  const {mj, model, data} = simulation;
  mj.mj_resetData(model, data);
  data.qpos.set(state.qpos);
  data.qvel.set(state.qvel);
  data.qfrc_applied.set(state.applied);
  simulation.setTargets(state.targets);
  mj.mj_forward(model, data);
  const factors = data.efc_KBIP, rows = [...Array(data.ne).keys()];
  return {
    R: rows.map((row) => data.efc_R[row]),
    bias: rows.map((row) => -data.efc_aref[row] - factors[KBIP * row + 1] * data.efc_vel[row] -
        factors[KBIP * row] * factors[KBIP * row + 2] * data.efc_pos[row]),
    force: simulation.driven().map((one) => one.force),
  };
}

/** Writes rows.json in the present folder. */
export function rows(engine) {
  const {drives, states} = JSON.parse(fs.readFileSync('states.json', 'utf8'));
  const simulation = new Simulation(engine, fs.readFileSync('model.xml', 'utf8'), drives);
  const {mj, model, data, equalities} = simulation;
  const measured = states.map((state) => at(simulation, state));
  mj.mj_forward(model, data);
  const names = Object.fromEntries(Object.entries(equalities).map(([name, id]) => [id, name]));
  fs.writeFileSync('rows.json', JSON.stringify({
    messages: simulation.messages,
    equalities: Array.from(data.efc_id.slice(0, data.ne), (id) => names[id]),
    states: measured,
  }));
  return {};
}
