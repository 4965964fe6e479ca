// The time that plots and replay share, and the bar that controls it.
import {element} from './data.js';

const kSpeeds = [0.1, 0.25, 0.5, 1, 2, 4];

export class Timeline {
  /** start and end [s]; sample: step of the arrow keys [s]; worst: [{time, label}]. */
  constructor({start, end, sample, worst}) {
    Object.assign(this, {start, end, sample, worst});
    this.time = start;
    this.playing = false;
    this.speed = 1;
    this.listeners = [];
  }

  onChange(listener) {
    this.listeners.push(listener);
  }

  set(time) {
    this.time = Math.min(this.end, Math.max(this.start, time));
    for (const listener of this.listeners) listener(this.time);
  }

  play(on = !this.playing) {
    if (on === this.playing || this.end <= this.start) return;
    this.playing = on;
    if (on) {
      if (this.time >= this.end) this.time = this.start;
      this.last = performance.now();
      requestAnimationFrame((now) => this.tick(now));
    }
    this.set(this.time);
  }

  tick(now) {
    if (!this.playing) return;
    const elapsed = Math.max(0, Math.min(0.25, (now - this.last) / 1000));
    this.last = now;
    const next = this.time + this.speed * elapsed;
    if (next >= this.end) this.playing = false;
    this.set(next);
    if (this.playing) requestAnimationFrame((later) => this.tick(later));
  }

  /** Moves by whole samples. */
  step(samples) {
    this.play(false);
    this.set(this.start + (Math.round((this.time - this.start) / this.sample) + samples) * this.sample);
  }

  nextWorst() {
    if (this.worst.length === 0) return;
    this.play(false);
    const after = this.worst.find((worst) => worst.time > this.time + 1e-9);
    this.set((after ?? this.worst[0]).time);
  }
}

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

/** The bar at the bottom of the window. */
export function timelineBar(timeline) {
  const play = element('button', {type: 'button', id: 'play', class: 'play', 'aria-label': 'Play',
                                  onclick: () => timeline.play()}, icon(kPlay));
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
    slider.value = time;
    slider.setAttribute('aria-valuetext', `${time.toFixed(3)} seconds`);
    clock.textContent = `${time.toFixed(2)} s`;
    play.firstChild.firstChild.setAttribute('d', timeline.playing ? kPause : kPlay);
    play.setAttribute('aria-label', timeline.playing ? 'Pause' : 'Play');
  });
  return element('div', {class: 'timeline', role: 'region', 'aria-label': 'Timeline'}, play, clock,
                 element('div', {class: 'track'}, slider, marks), speed,
                 ...(timeline.worst.length ? [worst] : []), help);
}

const kKeys = [
  ['Space', 'play, pause'], ['← →', 'one sample back, forth (Shift: ten)'], ['Home End', 'start, end'],
  ['W', 'next worst sample'], ['+ −', 'zoom the plots in, out'], ['0', 'whole time span'],
  ['T', 'colour scheme'], ['?', 'this list'],
  ['in the replay', 'arrows turn, + − zoom, R resets the view'],
];

function keyboardHelp() {
  const old = document.getElementById('keys');
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

/** Keys of the page; `plots` and `toggleTheme` may be missing. */
export function bindKeys(timeline, plots, toggleTheme) {
  document.addEventListener('keydown', (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || event.defaultPrevented) {
      const slider = event.target.id === 'time' && event.defaultPrevented;
      if (!slider) return;
    }
    const tag = event.target.tagName;
    if (tag === 'SELECT' || tag === 'TEXTAREA' || document.querySelector('dialog[open]')) return;
    const many = event.shiftKey ? 10 : 1;
    const actions = {
      ' ': () => timeline.play(),
      ArrowLeft: () => timeline.step(-many),
      ArrowRight: () => timeline.step(many),
      Home: () => timeline.set(timeline.start),
      End: () => timeline.set(timeline.end),
      w: () => timeline.nextWorst(),
      '+': () => plots?.zoom(0.5, timeline.time),
      '-': () => plots?.zoom(2, timeline.time),
      '0': () => plots?.reset(),
      t: () => toggleTheme(),
      '?': () => keyboardHelp().showModal(),
    };
    const action = actions[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (!action) return;
    if (event.key === ' ' && (tag === 'BUTTON' || tag === 'SUMMARY' || tag === 'A')) return;
    event.preventDefault();
    action();
  });
}
