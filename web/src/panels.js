// What the plots over time show.
import {driveColor, shownWitness} from './data.js';

const kAxes = ['x', 'y', 'z'], kAngles = ['roll', 'pitch', 'yaw'];
const kDegrees = 180 / Math.PI;

export const groupBy = (items, key) => {
  const groups = new Map();
  for (const item of items) groups.set(key(item), [...(groups.get(key(item)) ?? []), item]);
  return groups;
};

export const nameOf = (witness) => witness.replace('_', ' ');

/**
 * A panel: {title, note, unit, log, lines: [{key, label, color(), style, values}], limit, worst}.
 * key groups lines for the legend and for switching; style is a witness or "solid".
 */
export function makePanels(data) {
  const panels = [];
  const drives = data.drives.map((drive, index) => ({...drive, index}));
  const witnessLines = (drive, quantity) => data.witnesses.filter((w) => w[quantity][drive.index])
      .map((w) => ({key: drive.name, label: w.name, color: () => driveColor(drive.index),
                    style: w.name, values: w[quantity][drive.index]}));
  for (const [unit, group] of groupBy(drives, (drive) => drive.unit)) {
    panels.push({title: unit === 'N' ? 'Drive forces' : 'Drive torques', unit, styles: true,
                 lines: group.flatMap((drive) => witnessLines(drive, 'force'))});
  }
  for (const pair of data.pairs) {
    const lines = drives.filter((drive) => pair.error[drive.index])
                      .map((drive) => ({key: drive.name, label: drive.name, style: 'solid',
                                        color: () => driveColor(drive.index),
                                        values: pair.error[drive.index]}));
    panels.push({title: `Force error: ${pair.measured} against ${pair.truth}`, log: true, unit: '',
                 note: 'relative to the largest force', lines, limit: pair.limit, pair: pair.name,
                 worst: pair.worst});
  }
  for (const [unit, group] of groupBy(drives, (drive) => drive.position_unit)) {
    const witness = shownWitness(data);
    if (!witness) continue;
    panels.push({title: unit === 'm' ? 'Drive positions' : 'Drive angles', note: witness.name, unit,
                 lines: group.filter((drive) => witness.position[drive.index])
                            .map((drive) => ({key: drive.name, label: drive.name, style: 'solid',
                                              color: () => driveColor(drive.index),
                                              values: witness.position[drive.index]}))});
  }
  return [...panels, ...outputPanels(data), ...auditPanels(data)]
      .filter((panel) => panel.lines.some((line) => line.values.some(Number.isFinite)));
}

function outputPanels(data) {
  const panels = [];
  const witness = shownWitness(data);
  for (const [o, output] of (witness?.outputs ?? []).entries()) {
    const lines = (names, offset, scale) => names.flatMap((name, i) =>
        data.witnesses.filter((w) => w.outputs[o]?.values[offset + i]).map((w) => ({
          key: name, label: w.name, style: w.name, color: () => driveColor(i),
          values: w.outputs[o].values[offset + i].map((value) => scale * value)})));
    panels.push({title: `Position of ${output.name}`, note: `in ${output.frame}`, unit: 'm',
                 lines: lines(kAxes, 0, 1)});
    panels.push({title: `Orientation of ${output.name}`, note: `in ${output.frame}`, unit: '°',
                 lines: lines(kAngles, 3, kDegrees)});
  }
  return panels;
}

function auditPanels(data) {
  const of = (key, label) => data.witnesses.filter((w) => w[key]).map((w) => (
      {key: label ? `${w.name}, ${label}` : w.name, label: w.name, style: w.name, values: w[key],
       color: () => driveColor(data.witnesses.indexOf(w))}));
  const limitOf = (metric) =>
      data.witnesses.find((w) => w.name === 'simulated')?.limits[metric];
  const power = [...of('power_input', 'input'),
                 ...of('power_rate', 'energy rate').map((line) => ({...line, dash: true}))];
  return [
    {title: 'Largest loop gap', unit: 'm', log: true, lines: of('closure_m', ''),
     limit: limitOf('closure_m')},
    {title: 'Largest loop twist', unit: 'rad', log: true, lines: of('closure_rad', ''),
     limit: limitOf('closure_rad')},
    {title: 'Power', note: 'input and rate of energy', unit: 'W', lines: power},
    {title: 'Power imbalance', note: '|input − energy rate| / largest power', unit: '', log: true,
     lines: of('power_error', ''), limit: limitOf('power_balance')},
  ];
}
