// Brings report.html to life: timeline, plots and replay on the embedded data.
import './report.css';

import {readData, shownWitness, worstSamples} from './data.js';
import {byId, element} from './dom.js';
import {Plots} from './plots.js';
import {Replay} from './replay.js';
import {Timeline} from './timeline.js';
import {bindKeys, timelineBar} from './timeline_bar.js';

/** @type {Record<string, string>} */
const kThemes = {auto: '◐ Auto', light: '☀ Light', dark: '☾ Dark'};

/**
 * Storage may be forbidden for local files.
 * @param {string} [theme] to be stored
 */
function storedTheme(theme) {
  try {
    if (theme !== undefined) localStorage.setItem('mbverify-theme', theme);
    return localStorage.getItem('mbverify-theme');
  } catch {
    return null;
  }
}

/** @param {() => void} onChange */
function themeButton(onChange) {
  const root = document.documentElement, names = Object.keys(kThemes);
  const button = element('button', {type: 'button', id: 'theme', title: 'Colour scheme (T)'});
  const show = (/** @type {string} */ theme) => {
    root.dataset.theme = theme;
    button.textContent = kThemes[theme];
    button.setAttribute('aria-label', `Colour scheme: ${theme}`);
  };
  const next = () => {
    const theme = names[(names.indexOf(root.dataset.theme ?? '') + 1) % names.length];
    storedTheme(theme);
    show(theme);
    onChange();
  };
  button.addEventListener('click', next);
  const stored = storedTheme() ?? '';
  show(stored in kThemes ? stored : 'auto');
  return {button, next};
}

/** @param {HTMLElement} parent @param {unknown} error */
function explain(parent, error) {
  const reason = error instanceof Error ? error.message : String(error);
  parent.replaceChildren(element('p', {class: 'faint'}, `Not available here: ${reason}. ` +
                                 'The pictures below show the same.'));
}

function start() {
  const data = readData(byId('page-data').textContent ?? '');
  const times = data.time.length > 1 ? data.time : data.replay.time;
  const timeline = new Timeline({
    start: times[0], end: times[times.length - 1],
    sample: times.length > 1 ? times[1] - times[0] : 1, worst: worstSamples(data)});
  /** @type {{data: typeof data, timeline: Timeline, replay?: Replay, plots?: Plots}} */
  const app = {data, timeline};
  const theme = themeButton(() => {
    app.plots?.build();
    app.replay?.update();
  });
  document.querySelector('.badges')?.append(theme.button);
  document.body.append(timelineBar(timeline));
  document.body.classList.add('scripted');
  const view = byId('replay-view');
  try {
    app.replay = new Replay(view, data, timeline);
  } catch (error) {
    explain(view, error);
  }
  const plots = byId('plot-view');
  if (shownWitness(data)) app.plots = new Plots(plots, data, timeline);
  else plots.append(element('p', {}, 'No witness gave any signal.'));
  matchMedia('(prefers-color-scheme: dark)').addEventListener('change', () => app.plots?.build());
  bindKeys(timeline, app.plots, theme.next);
  timeline.set(timeline.start);
  // For tests and for the browser's console.
  Object.assign(globalThis, {mbverify: app});
  document.documentElement.dataset.ready = String(Math.round(performance.now()));
}

start();
