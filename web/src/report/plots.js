// Plots over time with one cursor, one zoom and one playhead.
import uPlot from 'uplot';
import 'uplot/dist/uPlot.min.css';

import {byId, element, isDark} from './dom.js';
import {decadeMarks, decades} from './log_axis.js';
import {formatError, formatValue, kResolution, nearest} from './numbers.js';
import {groupBy, makePanels, nameOf, withBands} from './panels.js';
import {axisLabels, largest, padded, plottable, powerOfTen, spread, zoomed} from './scales.js';

/**
 * @typedef {import('./panels.js').Panel} Panel
 * @typedef {import('./panels.js').Line} Line
 * @typedef {import('./data.js').PageData} PageData
 * @typedef {import('./timeline.js').Timeline} Timeline
 *
 * A panel on the page; no plot where every value is zero on a logarithmic axis.
 * @typedef {{panel: Panel, legend: HTMLElement, box: HTMLElement, plot?: uPlot, head?: HTMLElement,
 *            largest: number, readouts: {key: string, line: Line, readout: HTMLElement, chip: HTMLElement}[]}} PlotView
 */

const kPaperWidth = 640;  // [px], what A4 leaves between its margins
const kHeight = 210;      // [px]
const kFont = 'system-ui, sans-serif';

/** @typedef {{width: number, alpha?: number, spans?: boolean, marks?: boolean, dash?: number[]}} Style */

/** @type {Record<string, Style>} */
const kStyles = {
  solid: {width: 1.6},
  solver: {width: 1.6},
  reached: {width: 1.6, dash: [8, 5]},
  analytic: {width: 4.5, alpha: 0.38},
  reference: {width: 1.3, spans: true},  // a table may have fewer rows than there are samples
  simulated: {width: 0, marks: true},
};
/** Of a program outside. @type {Style} */
const kForeign = {width: 2, dash: [2, 5]};

/**
 * Marks spread evenly over what is visible.
 * @param {uPlot} u
 * @param {number} _series
 * @param {boolean} show
 * @param {number[][] | null} [gaps]
 */
function visibleMarks(u, _series, show, gaps) {
  const {min, max} = u.scales.x;
  if ((!show && !gaps) || min == null || max == null) return null;
  return spread(u.valToIdx(min), u.valToIdx(max));
}

/** @param {Line} line @param {boolean} log @returns {uPlot.Series} */
function seriesOf(line, log) {
  /** @type {Style} */
  const style = log ? {width: 1} : kStyles[line.style] ?? kForeign;
  const color = line.color();
  return {
    label: line.label,
    stroke: color,
    alpha: style.alpha ?? 1,
    width: style.width,
    dash: line.dash ? [7, 4] : style.dash,
    spanGaps: !line.band && (style.spans ?? false),  // a band's gap is not a missing row
    paths: style.marks ? () => null : undefined,
    points: {show: Boolean(style.marks), size: 5, width: 1.2, stroke: color,
             fill: isDark() ? '#14191f' : '#fff', filter: style.marks ? visibleMarks : undefined},
  };
}

/**
 * The part of the run that is shown.
 * @param {uPlot} u
 * @param {Float64Array} time
 */
function zoomOf(u, time) {
  const {min, max} = u.scales.x;
  const whole = time[time.length - 1] - time[0];
  return min == null || max == null || !(whole > 0) ? 1 : (max - min) / whole;
}

export class Plots {
  /** @param {HTMLElement} parent @param {PageData} data @param {Timeline} timeline */
  constructor(parent, data, timeline) {
    this.parent = parent;
    this.data = data;
    this.timeline = timeline;
    /** @type {Set<string>} */
    this.hidden = new Set();  // keys of lines
    /** @type {PlotView[]} */
    this.views = [];
    this.grid = element('div', {class: 'plots'});
    /** @type {number | null | undefined} */
    this.reading = undefined;  // the sample to be read at the next frame; null: at the playhead
    this.zooming = false;
    this.screenTheme = '';
    this.pair = (data.pairs.find((pair) => pair.name === 'simulated_vs_analytic' && pair.worst) ??
                 data.pairs.find((pair) => pair.worst) ?? data.pairs[0])?.name;
    this.panels = makePanels(data);
    /** @type {[number, number]} */
    this.range = [timeline.start, timeline.end];
    this.build();
    new ResizeObserver(() => this.resize()).observe(parent);
    this.drawForPaper();
    timeline.onChange(() => this.moveHead());
  }

  // On paper plots have the paper's width and its colours.
  drawForPaper() {
    addEventListener('beforeprint', () => {
      this.screenTheme = document.documentElement.dataset.theme ?? '';
      document.documentElement.dataset.theme = 'light';
      this.build(kPaperWidth);
    });
    addEventListener('afterprint', () => {
      if (this.screenTheme) document.documentElement.dataset.theme = this.screenTheme;
      else delete document.documentElement.dataset.theme;
      this.build();
    });
  }

  shown() {
    return this.panels.filter((panel) => !panel.pair || panel.pair === this.pair);
  }

  /** @param {number} [width] of the plots [px]; what the window leaves if not given */
  build(width) {
    for (const view of this.views) view.plot?.destroy();
    this.grid = element('div', {class: 'plots'});
    this.views = this.shown().map((panel) => this.addPanel(panel));
    this.parent.replaceChildren(this.toolbar(), this.grid);
    this.resize(width);
    this.moveHead();
  }

  toolbar() {
    const bar = element('div', {class: 'toolbar'});
    /** @type {(text: string, title: string, action: () => void) => void} */
    const button = (text, title, action) =>
        bar.append(element('button', {type: 'button', title, onclick: action}, text));
    if (this.data.pairs.length > 1) {
      const select = element('select', {id: 'pair', onchange: () => {
        this.pair = select.value;
        this.build();
        byId('pair').focus();
      }});
      for (const pair of this.data.pairs) {
        select.append(element('option', {value: pair.name, selected: pair.name === this.pair},
                              nameOf(pair.measured) + ' against ' + nameOf(pair.truth)));
      }
      bar.append(element('label', {}, 'Errors of ', select));
    }
    button('Zoom in', 'Zoom in around the playhead (+)', () => this.zoom(0.5, this.timeline.time));
    button('Zoom out', 'Zoom out (−)', () => this.zoom(2, this.timeline.time));
    button('Whole run', 'Show the whole run (0, or double-click)', () => this.reset());
    const key = element('span', {class: 'styles'});
    for (const witness of this.data.witnesses) {
      const style = witness.name in kStyles ? witness.name : 'foreign';
      key.append(element('span', {class: `style ${style}`}, element('i'), witness.name));
    }
    bar.append(key, element('span', {class: 'faint wide'}, 'drag to zoom, click to set the time; ' +
                               `0: below ${kResolution} of the plot's largest`));
    return bar;
  }

  /** @param {Panel} panel */
  addPanel(panel) {
    const caption = element('figcaption', {}, element('b', {}, panel.title),
                            panel.unit ? ` [${panel.unit}]` : '',
                            element('span', {class: 'faint'}, panel.note ? ` ${panel.note}` : ''));
    const legend = element('div', {class: 'legend'});
    const box = element('div', {class: 'plot'});
    this.grid.append(element('figure', {class: 'panel'}, caption, legend, box));
    /** @type {PlotView} */
    const view = {panel, legend, box, largest: largest(panel.lines, this.data.time)?.value ?? 0, readouts: []};
    const range = panel.log ? decades(panel.lines, panel.limit) : null;
    this.addLegend(view);
    if (panel.log && !range) {
      box.append(element('p', {class: 'faint'}, 'Exactly zero at every sample.'));
      return view;
    }
    this.describe(view);
    view.plot = new uPlot(this.options(view, range), this.columns(panel, range), box);
    view.head = element('div', {class: 'playhead', 'aria-hidden': 'true'});
    view.plot.over.append(view.head);
    return view;
  }

  // One entry per key, with the value at the cursor.
  /** @param {PlotView} view */
  addLegend(view) {
    const {panel} = view;
    for (const [key, lines] of groupBy(panel.lines, (line) => line.key)) {
      const line = lines.find((candidate) => candidate.style === 'simulated') ?? lines[lines.length - 1];
      const readout = element('span', {class: 'value'});
      const chip = element('button', {type: 'button', class: 'chip', 'aria-pressed': 'true',
                                      title: 'Show or hide', onclick: () => this.toggle(key)},
                           element('i', {style: `background:${line.color()}`}), key + ' ', readout);
      view.legend.append(chip);
      view.readouts.push({key, line, readout, chip});
    }
  }

  /** @param {PlotView} view */
  describe({panel, box}) {
    const worst = largest(panel.lines, this.data.time);
    box.setAttribute('role', 'img');
    box.setAttribute('aria-label', `${panel.title} over time. ` + (worst === null ? '' :
        `Largest ${formatValue(worst.value, panel.unit)}, ${worst.key}, at ${worst.time} s.`));
  }

  /** @param {Panel} panel @param {[number, number] | null} range @returns {uPlot.AlignedData} */
  columns(panel, range) {
    return [Array.from(this.data.time),
            ...panel.lines.map((line) => plottable(line.values, range?.[0]))];
  }

  /**
   * @param {PlotView} view
   * @param {[number, number] | null} range of a logarithmic axis
   * @returns {uPlot.Options}
   */
  options(view, range) {
    const {panel} = view;
    return {
      width: 600,
      height: kHeight,
      legend: {show: false},
      padding: [10, 14, 0, 0],
      cursor: {sync: {key: 'mbverify', setSeries: false, scales: ['x', null]},
               drag: {x: true, y: false, setScale: true}, points: {show: false}, y: false},
      scales: {x: {time: false, min: this.range[0], max: this.range[1]},
               y: range ? {distr: 3, log: 10, range: () => range}
                        : {range: (_u, min, max) => padded(...withBands(panel.lines, min, max))}},
      axes: this.axes(range),
      series: [{}, ...panel.lines.map((line) => (
          {...seriesOf(line, panel.log === true), show: !this.hidden.has(line.key)}))],
      hooks: {
        setScale: [(u, key) => { if (key === 'x') this.followZoom(u); }],
        setCursor: [(u) => this.readSoon(u.cursor.idx ?? null)],
        draw: [(u) => { this.drawBands(u, panel); this.drawMarks(u, panel); this.placeHead(view, u); }],
        ready: [(u) => this.clickSetsTime(u)],
      },
    };
  }

  /** @param {[number, number] | null} range of a logarithmic axis @returns {uPlot.Axis[]} */
  axes(range) {
    const css = getComputedStyle(document.documentElement);
    const ink = css.getPropertyValue('--faint').trim(), grid = css.getPropertyValue('--grid').trim();
    const lines = {stroke: grid, width: 1};
    const axis = {stroke: ink, font: `12px ${kFont}`, grid: lines, ticks: lines};
    const times = {...axis, size: 34, values: (/** @type {uPlot} */ _u, /** @type {number[]} */ splits) =>
      axisLabels(splits).map((text) => text && text + ' s')};
    if (!range) return [times, {...axis, size: 62, values: (_u, splits) => axisLabels(splits)}];
    // uPlot's own marks of a logarithmic axis do not end where steps fall below its rounding.
    const filter = (/** @type {uPlot} */ _u, /** @type {number[]} */ splits) => splits;
    return [times, {...axis, size: 62, splits: () => decadeMarks(...range), filter,
                    grid: {...lines, filter}, ticks: {...lines, filter},
                    values: (_u, splits) => splits.map(powerOfTen)}];
  }

  /** @param {uPlot} u */
  clickSetsTime(u) {
    let down = 0;
    u.over.addEventListener('mousedown', (event) => { down = event.clientX; });
    u.over.addEventListener('click', (event) => {
      if (Math.abs(event.clientX - down) > 3) return;
      this.timeline.set(u.posToVal(event.clientX - u.over.getBoundingClientRect().left, 'x'));
    });
  }

  // Shades what friction at rest leaves open: one stroke per sample, as wide as the samples are apart.
  /** @param {uPlot} u @param {Panel} panel */
  drawBands(u, panel) {
    const {ctx, bbox} = u, {time} = this.data;
    ctx.save();
    ctx.beginPath();
    ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
    ctx.clip();
    for (const {key, color, band} of panel.lines) {
      if (!band || this.hidden.has(key)) continue;
      ctx.strokeStyle = color();
      ctx.globalAlpha = 0.22;
      ctx.lineWidth = Math.max(2, bbox.width / Math.max(1, time.length - 1) / zoomOf(u, time));
      ctx.beginPath();
      time.forEach((t, i) => {
        if (!Number.isFinite(band.lower[i])) return;
        const x = u.valToPos(t, 'x', true);
        ctx.moveTo(x, u.valToPos(band.lower[i], 'y', true));
        ctx.lineTo(x, u.valToPos(band.upper[i], 'y', true));
      });
      ctx.stroke();
    }
    ctx.restore();
  }

  /** @param {uPlot} u @param {Panel} panel */
  drawMarks(u, panel) {
    const {ctx, bbox} = u;
    const css = getComputedStyle(document.documentElement);
    const ratio = devicePixelRatio || 1;
    ctx.save();
    ctx.textAlign = 'left';
    ctx.textBaseline = 'alphabetic';
    ctx.font = `${12 * ratio}px ${kFont}`;
    if (panel.limit) {
      const y = u.valToPos(panel.limit, 'y', true);
      ctx.strokeStyle = ctx.fillStyle = css.getPropertyValue('--bad').trim();
      ctx.setLineDash([8 * ratio, 5 * ratio]);
      ctx.lineWidth = 1.5 * ratio;
      ctx.beginPath();
      ctx.moveTo(bbox.left, y);
      ctx.lineTo(bbox.left + bbox.width, y);
      ctx.stroke();
      ctx.fillText(`limit ${formatError(panel.limit)}`, bbox.left + 8 * ratio, y + 15 * ratio);
    }
    const {min = 0, max = 0} = u.scales.x;
    if (panel.worst && panel.worst.time >= min && panel.worst.time <= max) this.drawWorst(u, panel.worst, ratio, css);
    ctx.restore();
  }

  /**
   * @param {uPlot} u
   * @param {import('./data.js').WorstError} worst
   * @param {number} ratio of pixels
   * @param {CSSStyleDeclaration} css
   */
  drawWorst(u, worst, ratio, css) {
    const {ctx, bbox} = u;
    const x = u.valToPos(worst.time, 'x', true);
    const y = Math.max(bbox.top + 8 * ratio, u.valToPos(worst.value || (u.scales.y.min ?? 0), 'y', true));
    ctx.setLineDash([]);
    ctx.lineWidth = 2 * ratio;
    ctx.strokeStyle = ctx.fillStyle = css.getPropertyValue('--ink').trim();
    ctx.beginPath();
    ctx.arc(x, y, 6 * ratio, 0, 7);
    ctx.stroke();
    const left = x > bbox.left + bbox.width / 2;
    ctx.textAlign = left ? 'right' : 'left';
    ctx.fillText(`worst ${formatError(worst.value)}, ${this.data.drives[worst.drive].name}`,
                 x + (left ? -11 : 11) * ratio, y + 4 * ratio);
    ctx.textAlign = 'left';
  }

  /**
   * All plots' cursors move together; their values are written once per picture.
   * @param {number | null} index
   */
  readSoon(index) {
    if (this.reading === undefined) {
      requestAnimationFrame(() => {
        this.read(this.reading ?? null);
        this.reading = undefined;
      });
    }
    this.reading = index;
  }

  /** @param {number | null} index */
  read(index) {
    const at = index ?? nearest(this.data.time, this.timeline.time);
    for (const view of this.views) {
      for (const {line, readout} of view.readouts) {
        const value = line.values[at];
        readout.textContent = view.panel.log ? formatError(value)
                                             : formatValue(value, view.panel.unit, view.largest);
      }
    }
  }

  /** @param {string} key */
  toggle(key) {
    if (!this.hidden.delete(key)) this.hidden.add(key);
    for (const view of this.views) {
      view.panel.lines.forEach((line, i) => {
        if (line.key === key) view.plot?.setSeries(i + 1, {show: !this.hidden.has(key)});
      });
      for (const entry of view.readouts) {
        entry.chip.setAttribute('aria-pressed', String(!this.hidden.has(entry.key)));
      }
    }
  }

  /** @param {uPlot} source */
  followZoom(source) {
    if (this.zooming) return;
    const {min, max} = source.scales.x;
    if (min == null || max == null || (min === this.range[0] && max === this.range[1])) return;
    this.setRange(min, max);
  }

  /** @param {number} min @param {number} max [s] */
  setRange(min, max) {
    this.zooming = true;
    this.range = [min, max];
    for (const view of this.views) view.plot?.setScale('x', {min, max});
    this.zooming = false;
    this.moveHead();
  }

  /** @param {number} factor of the visible span @param {number} around a time [s] */
  zoom(factor, around) {
    this.setRange(...zoomed(this.range, factor, around, this.timeline));
  }

  reset() {
    this.setRange(this.timeline.start, this.timeline.end);
  }

  // uPlot takes a new range at its next drawing; that places the heads, too.
  moveHead() {
    for (const view of this.views) if (view.plot) this.placeHead(view, view.plot);
    if (!this.views.some((view) => (view.plot?.cursor.left ?? -1) >= 0)) this.readSoon(null);
  }

  /** @param {PlotView} view @param {uPlot} plot */
  placeHead({head}, plot) {
    if (!head) return;
    const {time} = this.timeline;
    const {min = 0, max = 0} = plot.scales.x;
    const slack = 1e-9 * (max - min);  // of a time that was rounded
    const inside = time >= min - slack && time <= max + slack;
    head.style.display = inside ? '' : 'none';
    head.style.transform = `translateX(${plot.valToPos(time, 'x')}px)`;
  }

  /** @param {number} [given] width of the plots [px] */
  resize(given) {
    for (const view of this.views) {
      const width = given ?? view.box.clientWidth;
      if (view.plot && width > 0 && width !== view.plot.width) {
        view.plot.setSize({width, height: kHeight});
      }
    }
    this.moveHead();
  }
}
