// What stands beside the replay: switches, the meaning of the arrows, the drives' numbers.
import {driveColor, element, isDark} from './dom.js';
import {formatError, formatForce, formatValue} from './numbers.js';

const kColumns = ['drive', 'force', 'error', 'position'];

export class ReplaySide {
  /**
   * @param {import('./data.js').Drive[]} drives
   * @param {import('./data.js').Pair | null} errors whose errors can colour the arrows
   * @param {{colour: () => void, reset: () => void}} actions
   * @param {Record<string, (on: boolean) => void>} switches all on at first
   */
  constructor(drives, errors, actions, switches) {
    this.drives = drives;
    this.errors = errors;
    this.colouring = element('select', {id: 'colouring', onchange: actions.colour},
                             element('option', {value: 'sign'}, 'sign'));
    if (errors) this.colouring.append(element('option', {value: 'error'}, 'error'));
    this.legend = element('p', {class: 'force-legend'});
    this.legendFor = '';  // colouring and scheme that the legend is made for
    this.dots = drives.map(() => element('i', {class: 'dot'}));
    this.cells = drives.map(() => ['force', 'error', 'position'].map(() => element('td', {class: 'n'})));
    this.node = element('div', {class: 'side'}, this.toolbar(actions, switches), this.legend, this.table());
  }

  /**
   * @param {{reset: () => void}} actions
   * @param {Record<string, (on: boolean) => void>} switches
   */
  toolbar({reset}, switches) {
    const boxes = Object.entries(switches).map(([text, action]) => {
      const box = element('input', {type: 'checkbox', checked: true});
      box.addEventListener('change', () => action(box.checked));
      return element('label', {}, box, ' ' + text);
    });
    return element('div', {class: 'toolbar'}, element('label', {}, 'Arrows show ', this.colouring), ...boxes,
                   element('button', {type: 'button', onclick: reset}, 'Reset view'));
  }

  table() {
    const head = kColumns.map((title) =>
        element('th', {scope: 'col', class: title === 'drive' ? '' : 'n'}, title));
    const rows = this.drives.map(({name}, i) =>
        element('tr', {}, element('th', {scope: 'row'}, this.dots[i], name), ...this.cells[i]));
    return element('div', {class: 'scroll'},
                   element('table', {class: 'live'}, element('thead', {}, element('tr', {}, ...head)),
                           element('tbody', {}, ...rows)));
  }

  /** Whether the arrows' colours show the error. */
  showsError() {
    return this.colouring.value === 'error';
  }

  /** @param {{force: number, half: number, error: number, position: number}[]} numbers by drive */
  fill(numbers) {
    this.drives.forEach(({unit, position_unit}, i) => {
      const [force, error, position] = this.cells[i], now = numbers[i];
      force.textContent = formatForce(now.force, now.half, unit);
      error.textContent = formatError(now.error);
      position.textContent = formatValue(now.position, position_unit);
    });
  }

  /**
   * @param {[number, number]} range of the errors
   * @param {Record<string, number>} largest force by unit: the longest arrow
   */
  fillLegend([low, high], largest) {
    const shown = this.colouring.value + isDark();
    if (this.legendFor === shown) return;
    this.legendFor = shown;
    this.dots.forEach((dot, i) => { dot.style.background = driveColor(i); });
    if (this.showsError() && this.errors) {
      this.legend.replaceChildren(
          element('span', {}, formatError(low)), element('i', {class: 'ramp'}),
          element('span', {}, `${formatError(high)} of the largest force, `),
          element('span', {}, `${this.errors.measured} against ${this.errors.truth}`));
      return;
    }
    const longest = Object.entries(largest).map(([unit, value]) => formatValue(value, unit)).join(', ');
    this.legend.replaceChildren(
        element('span', {class: 'key push'}, element('i'), 'positive (push)'),
        element('span', {class: 'key pull'}, element('i'), 'negative (pull)'),
        element('span', {class: 'key closure'}, element('i'), 'loop closure'),
        element('span', {class: 'faint'}, longest ? `longest arrow ${longest}` : ''));
  }
}
