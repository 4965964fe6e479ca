// The bar that controls the time, and the keys of the page.
import {element} from './dom.js';

/** @typedef {import('./timeline.js').Timeline} Timeline */

const kSpeeds = [0.1, 0.25, 0.5, 1, 2, 4];

/** @param {string} path */
const icon = (path) => {
  const svg = document.createElementNS('http://www.w3.org/2000/svg', 'svg');
  svg.setAttribute('viewBox', '0 0 16 16');
  svg.setAttribute('aria-hidden', 'true');
  const shape = document.createElementNS(svg.namespaceURI, 'path');
  shape.setAttribute('d', path);
  svg.append(shape);
  return svg;
};
const kPlay = 'M3 1.5v13l11-6.5z', kPause = 'M3 2h4v12H3zM9 2h4v12H9z';

/**
 * The bar at the bottom of the window.
 * @param {Timeline} timeline
 */
export function timelineBar(timeline) {
  const sign = icon(kPlay);
  const play = element('button', {type: 'button', id: 'play', class: 'play', 'aria-label': 'Play',
                                  onclick: () => timeline.play()}, sign);
  const slider = element('input', {type: 'range', id: 'time', min: timeline.start, max: timeline.end,
                                   step: 'any', value: timeline.start, 'aria-label': 'Time'});
  slider.addEventListener('input', () => {
    timeline.play(false);
    timeline.set(Number(slider.value));
  });
  slider.addEventListener('keydown', (event) => {
    if (['ArrowLeft', 'ArrowRight', 'Home', 'End'].includes(event.key)) event.preventDefault();
  });
  const marks = element('div', {class: 'marks', 'aria-hidden': 'true'});
  for (const worst of timeline.worst) {
    const at = (worst.time - timeline.start) / (timeline.end - timeline.start || 1);
    marks.append(element('i', {style: `left:${100 * at}%`, title: worst.label}));
  }
  const clock = element('output', {id: 'clock', for: 'time'});
  const speed = element('select', {'aria-label': 'Speed', onchange: () => {
    timeline.speed = Number(speed.value);
  }});
  for (const value of kSpeeds) {
    speed.append(element('option', {value, selected: value === 1}, `${value}×`));
  }
  const worst = element('button', {type: 'button', title: 'Go to the worst sample (W)',
                                   onclick: () => timeline.nextWorst()}, 'Worst');
  const help = element('button', {type: 'button', class: 'help', 'aria-label': 'Keyboard shortcuts',
                                  onclick: () => keyboardHelp().showModal()}, '?');
  timeline.onChange((time) => {
    slider.value = String(time);
    slider.setAttribute('aria-valuetext', `${time.toFixed(3)} seconds`);
    clock.textContent = `${time.toFixed(2)} s`;
    sign.firstElementChild?.setAttribute('d', timeline.playing ? kPause : kPlay);
    play.setAttribute('aria-label', timeline.playing ? 'Pause' : 'Play');
  });
  return element('div', {class: 'timeline', role: 'region', 'aria-label': 'Timeline'}, play, clock,
                 element('div', {class: 'track'}, slider, marks), speed,
                 ...(timeline.worst.length ? [worst] : []), help);
}

const kKeys = [
  ['Space', 'play, pause'], ['← →', 'one sample back, forth (Shift: ten)'], ['Home End', 'start, end'],
  ['W', 'the worst sample; again: the next worst'], ['+ −', 'zoom the plots in, out'], ['0', 'whole time span'],
  ['T', 'colour scheme'], ['?', 'this list'],
  ['in the replay', 'arrows turn, + − zoom, R resets the view'],
];

function keyboardHelp() {
  const old = document.querySelector('dialog');
  if (old) return old;
  const list = element('dl');
  for (const [key, meaning] of kKeys) {
    list.append(element('dt', {}, key), element('dd', {}, meaning));
  }
  const dialog = element('dialog', {id: 'keys', 'aria-label': 'Keyboard shortcuts'},
                         element('h2', {}, 'Keyboard'), list,
                         element('form', {method: 'dialog'}, element('button', {}, 'Close')));
  document.body.append(dialog);
  return dialog;
}

/**
 * Keys of the page.
 * @param {Timeline} timeline
 * @param {{zoom: (factor: number, around: number) => void, reset: () => void} | undefined} plots
 * @param {() => void} toggleTheme
 */
export function bindKeys(timeline, plots, toggleTheme) {
  /** @type {Record<string, (many: number) => void>} */
  const actions = {
    ' ': () => timeline.play(),
    ArrowLeft: (many) => timeline.step(-many),
    ArrowRight: (many) => timeline.step(many),
    Home: () => timeline.set(timeline.start),
    End: () => timeline.set(timeline.end),
    w: () => timeline.nextWorst(),
    '+': () => plots?.zoom(0.5, timeline.time),
    '-': () => plots?.zoom(2, timeline.time),
    '0': () => plots?.reset(),
    t: () => toggleTheme(),
    '?': () => keyboardHelp().showModal(),
  };
  document.addEventListener('keydown', (event) => {
    const target = /** @type {Element} */ (event.target);
    if (event.ctrlKey || event.metaKey || event.altKey || event.defaultPrevented) {
      const slider = target.id === 'time' && event.defaultPrevented;
      if (!slider) return;
    }
    const tag = target.tagName;
    if (tag === 'SELECT' || tag === 'TEXTAREA' || document.querySelector('dialog[open]')) return;
    const action = actions[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (!action) return;
    if (event.key === ' ' && (tag === 'BUTTON' || tag === 'SUMMARY' || tag === 'A')) return;
    event.preventDefault();
    action(event.shiftKey ? 10 : 1);
  });
}
