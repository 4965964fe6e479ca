// Brings report.html to life: timeline, plots and replay on the embedded data.
import './report.css';

import {element, readData, shownWitness} from './data.js';
import {Plots} from './plots.js';
import {Replay} from './replay.js';
import {bindKeys, Timeline, timelineBar} from './timeline.js';

const kThemes = ['auto', 'light', 'dark'];

// Storage may be forbidden for local files.
function stored(value) {
  try {
    if (value !== undefined) localStorage.setItem('mbverify-theme', value);
    return localStorage.getItem('mbverify-theme');
  } catch {
    return null;
  }
}

function themeButton(onChange) {
  const root = document.documentElement;
  const button = element('button', {type: 'button', id: 'theme', title: 'Colour scheme (T)'});
  const show = (theme) => {
    root.dataset.theme = theme;
    button.textContent = {auto: '◐ Auto', light: '☀ Light', dark: '☾ Dark'}[theme];
    button.setAttribute('aria-label', `Colour scheme: ${theme}`);
  };
  const next = () => {
    const theme = kThemes[(kThemes.indexOf(root.dataset.theme) + 1) % kThemes.length];
    stored(theme);
    show(theme);
    onChange();
  };
  button.addEventListener('click', next);
  show(kThemes.includes(stored()) ? stored() : 'auto');
  return {button, next};
}

function worstSamples(data) {
  return data.pairs.filter((pair) => pair.worst && Number.isFinite(pair.worst.time))
      .map((pair) => ({time: pair.worst.time,
                       label: `${pair.measured} against ${pair.truth}: ${data.drives[pair.worst.drive].name}`}))
      .sort((a, b) => a.time - b.time)
      .filter((worst, i, all) => i === 0 || worst.time > all[i - 1].time);
}

function explain(parent, error) {
  parent.replaceChildren(element('p', {class: 'faint'}, `Not available here: ${error.message}. ` +
                                 'The pictures below show the same.'));
}

function start() {
  const data = readData();
  const times = data.time.length > 1 ? data.time : data.replay.time;
  const timeline = new Timeline({
    start: times[0], end: times[times.length - 1],
    sample: times.length > 1 ? times[1] - times[0] : 1, worst: worstSamples(data)});
  const app = {data, timeline};
  const theme = themeButton(() => {
    app.plots?.build();
    app.replay?.update();
  });
  document.querySelector('.badges').append(theme.button);
  document.body.append(timelineBar(timeline));
  document.body.classList.add('scripted');
  const view = document.getElementById('replay-view');
  try {
    app.replay = new Replay(view, data, timeline);
  } catch (error) {
    explain(view, error);
  }
  const plots = document.getElementById('plot-view');
  if (shownWitness(data)) app.plots = new Plots(plots, data, timeline);
  else plots.append(element('p', {}, 'No witness gave any signal.'));
  matchMedia('(prefers-color-scheme: dark)').addEventListener('change', () => app.plots?.build());
  bindKeys(timeline, app.plots, theme.next);
  timeline.set(timeline.start);
  // For tests and for the browser's console.
  globalThis.mbverify = app;
  document.documentElement.dataset.ready = String(Math.round(performance.now()));
}

start();
