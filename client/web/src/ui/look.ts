import type { Surface } from '../mesh/surface';
import { coloursOf, segmentColour, type Colouring } from '../viewer/material';
import { fill, h, svg } from './dom';
import { number } from './words';

/** Something to colour a mesh by. */
export interface Measure {
  name: string;
  unit: string;
  scale: Colouring['scale'];
  /** What the numbers are. */
  meaning: string;
  values: (surface: Surface) => Float32Array | undefined;
}

const kBins = 56, kWidth = 296, kHeight = 64;

/** Chooses what the mesh is coloured by; its histogram is the legend, and dragging over it selects. */
export class ColourPicker {
  readonly element = h('div', { class: 'colour-by' });
  private readonly select = h('select', { id: 'colour-by', onchange: () => this.choose(this.select.value) });
  private readonly legend = h('div', { class: 'legend-box' });
  private chosen = '';
  private values?: Float32Array;
  private range: [number, number] = [0, 1];
  private selection?: [number, number];

  constructor(
    private readonly apply: (colouring?: Colouring) => void,
    private readonly narrow: (range?: [number, number]) => void,
  ) {
    fill(this.element, h('div', { class: 'field row' }, h('label', { for: 'colour-by' }, 'Colour by'), this.select), this.legend);
  }

  private measures: Measure[] = [];
  private surface?: Surface;

  /** Offers these measures for a surface. Keeps what was chosen where it is still there. */
  offer(measures: Measure[], surface?: Surface): void {
    this.measures = measures;
    if (surface) this.surface = surface;
    else delete this.surface;
    fill(this.select, h('option', { value: '' }, 'nothing'), ...measures.map((one) => h('option', { value: one.name }, one.name)));
    this.choose(measures.some((one) => one.name === this.chosen) ? this.chosen : '');
  }

  choose(name: string): void {
    this.chosen = this.select.value = name;
    const measure = this.measures.find((one) => one.name === name);
    const values = measure && this.surface && measure.values(this.surface);
    delete this.selection;
    if (!measure || !values) {
      delete this.values;
      fill(this.legend);
      this.apply();
      return;
    }
    this.values = values;
    this.range = measure.scale === 'classes' ? extent(values) : robustRange(values, measure.scale === 'diverging');
    this.apply({ values, range: this.range, scale: measure.scale });
    this.draw(measure);
  }

  private draw(measure: Measure): void {
    const values = this.values!, [low, high] = this.range;
    const classes = measure.scale === 'classes';
    const bins = classes ? Math.min(64, high - low + 1) : kBins;
    const counts = new Float64Array(bins);
    const width = classes ? 1 : (high - low) / bins || 1;
    for (const x of values) {
      if (classes && x < 0) continue;
      counts[Math.min(bins - 1, Math.max(0, Math.floor((x - low) / width)))]! += 1;
    }
    const most = Math.max(...counts);
    const stops = coloursOf(measure.scale);
    const bars = Array.from(counts, (n, i) => {
      const height = n === 0 ? 0 : Math.max(1.5, (Math.sqrt(n / most)) * (kHeight - 4));
      return svg('rect', {
        x: (i * kWidth) / bins, width: Math.max(0.5, kWidth / bins - 0.6), y: kHeight - height, height,
        fill: classes ? segmentColour(low + i) : mixed(stops, (i + 0.5) / bins),
      });
    });
    const band = svg('rect', { y: 0, height: kHeight, class: 'band', x: 0, width: 0 });
    const picture = svg('svg', { viewBox: `0 0 ${kWidth} ${kHeight}`, class: 'histogram', preserveAspectRatio: 'none', role: 'img',
      'aria-label': `${measure.name} from ${number(low)} to ${number(high)} ${measure.unit}` }, ...bars, band);
    const note = h('span', { class: 'quiet-text', 'aria-live': 'polite' }, measure.meaning);
    this.listen(picture as SVGSVGElement, band, note, measure);
    fill(this.legend, picture as unknown as Node, h('div', { class: 'ends' }, h('span', {}, number(low)), h('span', {}, measure.unit), h('span', {}, number(high))), note);
  }

  private listen(picture: SVGSVGElement, band: SVGElement, note: HTMLElement, measure: Measure): void {
    const [low, high] = this.range;
    const span = measure.scale === 'classes' ? high - low + 1 : high - low;
    let from: number | undefined;
    const at = (event: PointerEvent) => {
      const box = picture.getBoundingClientRect();
      return Math.min(1, Math.max(0, (event.clientX - box.left) / box.width));
    };
    const show = (a: number, b: number) => {
      const classes = measure.scale === 'classes';
      const first = low + a * span, last = low + b * span;
      const range: [number, number] = classes ? [Math.floor(first) - 0.25, Math.floor(last) + 0.25] : [a <= 0.002 ? -1e30 : first, b >= 0.998 ? 1e30 : last];
      this.selection = range;
      band.setAttribute('x', String(a * kWidth));
      band.setAttribute('width', String(Math.max(1, (b - a) * kWidth)));
      const inside = this.values!.reduce((n, x) => n + (x >= range[0] && x <= range[1] ? 1 : 0), 0);
      note.textContent = classes ? `${Math.floor(first)} to ${Math.floor(last)}: ${inside} vertices` : `${number(first)} to ${number(last)}: ${inside} vertices. Click to show all.`;
      this.narrow(range);
    };
    picture.addEventListener('pointerdown', (event) => {
      picture.setPointerCapture(event.pointerId);
      from = at(event);
    });
    picture.addEventListener('pointermove', (event) => {
      if (from === undefined) return;
      const to = at(event);
      if (Math.abs(to - from) > 0.01) show(Math.min(from, to), Math.max(from, to));
    });
    picture.addEventListener('pointerup', (event) => {
      if (from !== undefined && Math.abs(at(event) - from) <= 0.01) {
        delete this.selection;
        band.setAttribute('width', '0');
        note.textContent = measure.meaning;
        this.narrow();
      }
      from = undefined;
    });
  }
}

function extent(values: Float32Array): [number, number] {
  let low = Infinity, high = -Infinity;
  for (const x of values) {
    if (x < 0) continue;
    if (x < low) low = x;
    if (x > high) high = x;
  }
  return low > high ? [0, 1] : [low, high];
}

/** From the 1st to the 99th percent, so that a few far ones do not take all the colours. */
function robustRange(values: Float32Array, symmetric: boolean): [number, number] {
  const step = Math.max(1, Math.floor(values.length / 50_000));
  const some = new Float32Array(Math.ceil(values.length / step));
  for (let i = 0, k = 0; i < values.length; i += step) some[k++] = values[i]!;
  some.sort();
  const at = (share: number) => some[Math.min(some.length - 1, Math.floor(share * some.length))]!;
  if (symmetric) {
    const size = Math.max(Math.abs(at(0.01)), Math.abs(at(0.99))) || 1;
    return [-size, size];
  }
  const low = at(0.01), high = at(0.99);
  return high > low ? [low, high] : [low, low + 1];
}

function mixed(stops: string[], t: number): string {
  const at = t * (stops.length - 1);
  const low = Math.min(Math.floor(at), stops.length - 2);
  return `color-mix(in srgb, ${stops[low]!}, ${stops[low + 1]!} ${(100 * (at - low)).toFixed(0)}%)`;
}
