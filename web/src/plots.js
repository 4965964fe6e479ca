// Plots over time with one cursor, one zoom and one playhead.
import uPlot from 'uplot';
import 'uplot/dist/uPlot.min.css';

import {element, formatError, formatValue, isDark, nearest} from './data.js';
import {decadeMarks, decades} from './log_axis.js';
import {groupBy, makePanels, nameOf} from './panels.js';

const kPaperWidth = 640;  // [px], what A4 leaves between its margins

// NaN is a gap; on a log axis zero is drawn at the lower edge.
function plottable(values, floor) {
  return Array.from(values, (value) => !Number.isFinite(value) ? null
                                       : floor && value < floor ? floor : value);
}

// Marks spread evenly over what is visible.
function spread(u, _series, show, indices) {
  if (!show && !indices) return null;
  const {min, max} = u.scales.x;
  const first = u.valToIdx(min), last = u.valToIdx(max);
  const step = Math.max(1, Math.floor((last - first) / 48));
  const kept = [];
  for (let i = first - (first % step); i <= last; i += step) if (i >= first) kept.push(i);
  return kept;
}

const kStyles = {
  solid: {width: 1.6},
  analytic: {width: 4.5, alpha: 0.38},
  reference: {width: 1.3, spans: true},  // a table may have fewer rows than there are samples
  simulated: {width: 0, marks: true},
};

function seriesOf(line, log) {
  const style = log ? {width: 1} : kStyles[line.style] ?? kStyles.solid;
  const color = line.color();
  return {
    label: line.label,
    stroke: color,
    alpha: style.alpha ?? 1,
    width: style.width,
    dash: line.dash ? [7, 4] : undefined,
    spanGaps: style.spans ?? false,
    paths: style.marks ? () => null : undefined,
    points: {show: Boolean(style.marks), size: 5, width: 1.2, stroke: color,
             fill: isDark() ? '#14191f' : '#fff', filter: style.marks ? spread : undefined},
  };
}

export class Plots {
  constructor(parent, data, timeline) {
    Object.assign(this, {parent, data, timeline});
    this.hidden = new Set();
    this.pair = (data.pairs.find((pair) => pair.name === 'simulated_vs_analytic' && pair.worst) ??
                 data.pairs.find((pair) => pair.worst) ?? data.pairs[0])?.name;
    this.panels = makePanels(data);
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

  build(width = null) {
    for (const view of this.views ?? []) view.plot?.destroy();
    this.grid = element('div', {class: 'plots'});
    this.views = this.shown().map((panel) => this.addPanel(panel));
    this.parent.replaceChildren(this.toolbar(), this.grid);
    this.resize(width);
    this.moveHead();
  }

  toolbar() {
    const bar = element('div', {class: 'toolbar'});
    const button = (text, title, action) =>
        bar.append(element('button', {type: 'button', title, onclick: action}, text));
    if (this.data.pairs.length > 1) {
      const select = element('select', {id: 'pair', onchange: () => {
        this.pair = select.value;
        this.build();
        document.getElementById('pair').focus();
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
      key.append(element('span', {class: `style ${witness.name}`}, element('i'), witness.name));
    }
    bar.append(key, element('span', {class: 'faint wide'}, 'drag to zoom, click to set the time'));
    return bar;
  }

  addPanel(panel) {
    const caption = element('figcaption', {}, element('b', {}, panel.title),
                            panel.unit ? ` [${panel.unit}]` : '',
                            element('span', {class: 'faint'}, panel.note ? ` ${panel.note}` : ''));
    const legend = element('div', {class: 'legend'});
    const box = element('div', {class: 'plot'});
    const figure = element('figure', {class: 'panel'}, caption, legend, box);
    this.grid.append(figure);
    const view = {panel, figure, legend, box, readouts: []};
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
  addLegend(view) {
    const {panel} = view;
    for (const [key, lines] of groupBy(panel.lines, (line) => line.key)) {
      const line = lines.find((candidate) => candidate.style === 'simulated') ?? lines.at(-1);
      const readout = element('span', {class: 'value'});
      const chip = element('button', {type: 'button', class: 'chip', 'aria-pressed': 'true',
                                      title: 'Show or hide', onclick: () => this.toggle(key)},
                           element('i', {style: `background:${line.color()}`}), key + ' ', readout);
      view.legend.append(chip);
      view.readouts.push({key, line, readout, chip});
    }
  }

  describe(view) {
    let worst = {value: -Infinity};
    for (const line of view.panel.lines) {
      line.values.forEach((value, i) => {
        if (Math.abs(value) > worst.value) {
          worst = {value: Math.abs(value), time: this.data.time[i], key: line.key};
        }
      });
    }
    view.box.setAttribute('role', 'img');
    view.box.setAttribute('aria-label', `${view.panel.title} over time. Largest ` +
        `${formatValue(worst.value, view.panel.unit)}, ${worst.key}, at ${worst.time} s.`);
  }

  columns(panel, range) {
    return [Array.from(this.data.time),
            ...panel.lines.map((line) => plottable(line.values, range?.[0]))];
  }

  options(view, range) {
    const {panel} = view;
    const css = getComputedStyle(document.documentElement);
    const ink = css.getPropertyValue('--faint').trim(), grid = css.getPropertyValue('--grid').trim();
    const font = '12px system-ui, sans-serif';
    const axis = {stroke: ink, font, grid: {stroke: grid, width: 1}, ticks: {stroke: grid, width: 1}};
    // uPlot's own marks of a logarithmic axis do not end where steps fall below its rounding.
    const marks = panel.log ? {splits: () => decadeMarks(...range), filter: (_u, splits) => splits} : {};
    const lines = panel.log ? {...marks, grid: {...axis.grid, filter: marks.filter},
                               ticks: {...axis.ticks, filter: marks.filter}} : {};
    const labels = panel.log
        ? (_u, splits) => splits.map(exponent)
        : (_u, splits) => axisLabels(splits);
    return {
      width: 600,
      height: 210,
      legend: {show: false},
      padding: [10, 14, 0, 0],
      cursor: {sync: {key: 'mbverify', setSeries: false, scales: ['x', null]},
               drag: {x: true, y: false, setScale: true}, points: {show: false}, y: false},
      scales: {x: {time: false, min: this.range[0], max: this.range[1]},
               y: panel.log ? {distr: 3, log: 10, range: () => range} : {range: padded}},
      axes: [{...axis, size: 34, values: (_u, splits) => axisLabels(splits).map((s) => s && s + ' s')},
             {...axis, ...lines, size: 62, values: labels}],
      series: [{}, ...panel.lines.map((line) => ({...seriesOf(line, panel.log), show: !this.hidden.has(line.key)}))],
      hooks: {
        setScale: [(u, key) => key === 'x' && this.followZoom(u)],
        setCursor: [(u) => this.readSoon(u.cursor.idx)],
        draw: [(u) => { this.drawMarks(u, panel); this.placeHead(view, u); }],
        ready: [(u) => this.clickSetsTime(u)],
      },
    };
  }

  clickSetsTime(u) {
    let down = 0;
    u.over.addEventListener('mousedown', (event) => { down = event.clientX; });
    u.over.addEventListener('click', (event) => {
      if (Math.abs(event.clientX - down) > 3) return;
      this.timeline.set(u.posToVal(event.clientX - u.over.getBoundingClientRect().left, 'x'));
    });
  }

  drawMarks(u, panel) {
    const {ctx, bbox} = u;
    const css = getComputedStyle(document.documentElement);
    const ratio = devicePixelRatio || 1;
    ctx.save();
    ctx.textAlign = 'left';
    ctx.textBaseline = 'alphabetic';
    ctx.font = `${12 * ratio}px system-ui, sans-serif`;
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
    const {min, max} = u.scales.x;
    if (panel.worst && panel.worst.time >= min && panel.worst.time <= max) this.drawWorst(u, panel.worst, ratio, css);
    ctx.restore();
  }

  drawWorst(u, worst, ratio, css) {
    const {ctx, bbox} = u;
    const x = u.valToPos(worst.time, 'x', true);
    const y = Math.max(bbox.top + 8 * ratio, u.valToPos(worst.value || u.scales.y.min, 'y', true));
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

  // All plots' cursors move together; their values are written once per picture.
  readSoon(index) {
    if (this.reading === undefined) {
      requestAnimationFrame(() => {
        this.read(this.reading);
        this.reading = undefined;
      });
    }
    this.reading = index ?? null;
  }

  read(index) {
    const at = index ?? nearest(this.data.time, this.timeline.time);
    for (const view of this.views ?? []) {
      for (const {line, readout} of view.readouts) {
        const value = line.values[at];
        readout.textContent = view.panel.log ? formatError(value) : formatValue(value, view.panel.unit);
      }
    }
  }

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

  followZoom(source) {
    if (this.zooming) return;
    const {min, max} = source.scales.x;
    if (min === null || (min === this.range[0] && max === this.range[1])) return;
    this.setRange(min, max);
  }

  setRange(min, max) {
    this.zooming = true;
    this.range = [min, max];
    for (const view of this.views ?? []) view.plot?.setScale('x', {min, max});
    this.zooming = false;
    this.moveHead();
  }

  /** Scales the visible span around a time. */
  zoom(factor, around) {
    const {start, end, sample} = this.timeline;
    const [min, max] = this.range;
    const span = Math.min(end - start, Math.max(4 * sample, factor * (max - min)));
    const centre = around >= min && around <= max ? around : (min + max) / 2;
    const low = Math.max(start, Math.min(end - span, centre - span * (centre - min) / (max - min)));
    this.setRange(low, low + span);
  }

  reset() {
    this.setRange(this.timeline.start, this.timeline.end);
  }

  // uPlot takes a new range at its next drawing; that places the heads, too.
  moveHead() {
    for (const view of this.views ?? []) if (view.plot) this.placeHead(view, view.plot);
    if (!this.views?.some((view) => view.plot?.cursor.left >= 0)) this.readSoon(null);
  }

  placeHead({head}, plot) {
    if (!head) return;
    const {time} = this.timeline;
    const {min, max} = plot.scales.x;
    const slack = 1e-9 * (max - min);  // of a time that was rounded
    const inside = time >= min - slack && time <= max + slack;
    head.style.display = inside ? '' : 'none';
    head.style.transform = `translateX(${plot.valToPos(time, 'x')}px)`;
  }

  resize(given = null) {
    for (const view of this.views ?? []) {
      const width = given ?? view.box.clientWidth;
      if (view.plot && width > 0 && width !== view.plot.width) {
        view.plot.setSize({width, height: 210});
      }
    }
    if (this.views) this.moveHead();
  }
}

const kRaised = {'-': '⁻', 0: '⁰', 1: '¹', 2: '²', 3: '³', 4: '⁴', 5: '⁵', 6: '⁶', 7: '⁷', 8: '⁸', 9: '⁹'};
function exponent(value) {
  const digits = String(Math.round(Math.log10(value)));
  return '10' + [...digits].map((digit) => kRaised[digit]).join('');
}

function axisLabels(splits) {
  const largest = Math.max(...splits.map((v) => Math.abs(v ?? 0)));
  const [scale, suffix] = largest >= 1e6 ? [1e-6, ' M'] : largest >= 1e4 ? [1e-3, ' k'] : [1, ''];
  return splits.map((v) => {
    if (v === null) return '';
    if (largest > 0 && largest < 1e-3) return v === 0 ? '0' : v.toExponential(0).replace('-', '−');
    return (v === 0 ? '0' : String(Number((v * scale).toPrecision(6))).replace('-', '−') + suffix);
  });
}

// Room above and below; a constant signal is not blown up to fill the plot.
function padded(_u, min, max) {
  if (min === null) return [0, 1];
  const size = Math.max(Math.abs(min), Math.abs(max));
  const span = Math.max(max - min, 1e-3 * size, 1e-9);
  const middle = (min + max) / 2;
  return [middle - 0.56 * span, middle + 0.56 * span];
}
