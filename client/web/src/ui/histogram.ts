import { coloursOf, segmentColour, type Colouring } from '../viewer/material';
import { fill, h, svg } from './dom';
import { count, number } from './words';

const kBins = 56, kWidth = 296, kHeight = 64;

export interface Distribution {
  name: string;
  unit: string;
  meaning: string;
  scale: Colouring['scale'];
  values: Float32Array;
  /** What the ends of the colours stand for. Numbers beyond them count to the bins at the ends. */
  range: [number, number];
}

/** The legend of a colouring: a histogram in its colours. Dragging over it, or two numbers below, select a range. */
export class Histogram {
  readonly element = h('div', { class: 'legend-box' });
  private readonly band = svg('rect', { y: 0, height: kHeight, class: 'band', x: 0, width: 0 });
  private readonly note = h('span', { class: 'quiet-text', 'aria-live': 'polite' });
  private readonly ends: [HTMLInputElement, HTMLInputElement];
  private readonly classes: boolean;

  constructor(private readonly of: Distribution, private readonly narrow: (range?: [number, number]) => void) {
    this.classes = of.scale === 'classes';
    const [low, high] = of.range;
    const end = (words: string, value: number) =>
      h('input', { type: 'number', step: 'any', value: number(value), 'aria-label': `${words} ${of.name} that is shown`, onchange: () => this.typed() });
    this.ends = [end('Smallest', low), end('Largest', high)];
    const picture = svg('svg', { viewBox: `0 0 ${kWidth} ${kHeight}`, class: 'histogram', preserveAspectRatio: 'none', role: 'img',
      'aria-label': `${of.name} from ${number(low)} to ${number(high)} ${of.unit}` }, ...this.bars(), this.band);
    this.listen(picture);
    this.note.textContent = of.meaning;
    fill(this.element, picture, h('div', { class: 'ends' }, this.ends[0], h('span', {}, of.unit), this.ends[1]), this.note);
  }

  private get span(): number {
    const [low, high] = this.of.range;
    return this.classes ? high - low + 1 : high - low;
  }

  private bars(): SVGElement[] {
    const { values, range: [low], scale } = this.of;
    const bins = this.classes ? Math.min(64, this.span) : kBins;
    const counts = new Float64Array(bins);
    const width = this.span / bins || 1;
    for (const x of values) {
      if (this.classes && x < 0) continue;
      counts[Math.min(bins - 1, Math.max(0, Math.floor((x - low) / width)))]! += 1;
    }
    const most = Math.max(...counts);
    const stops = coloursOf(scale);
    return Array.from(counts, (n, i) => {
      const height = n === 0 ? 0 : Math.max(1.5, Math.sqrt(n / most) * (kHeight - 4));
      return svg('rect', {
        x: (i * kWidth) / bins, width: Math.max(0.5, kWidth / bins - 0.6), y: kHeight - height, height,
        fill: this.classes ? segmentColour(Math.floor(low + i * width)) : mixed(stops, (i + 0.5) / bins),
      });
    });
  }

  private listen(picture: SVGElement): void {
    let from: number | undefined;
    const at = (event: PointerEvent) => {
      const box = picture.getBoundingClientRect();
      return Math.min(1, Math.max(0, (event.clientX - box.left) / box.width));
    };
    picture.addEventListener('pointerdown', (event) => {
      picture.setPointerCapture(event.pointerId);
      from = at(event);
    });
    picture.addEventListener('pointermove', (event) => {
      if (from === undefined) return;
      const to = at(event);
      if (Math.abs(to - from) > 0.01) this.drag(Math.min(from, to), Math.max(from, to));
    });
    picture.addEventListener('pointerup', (event) => {
      if (from !== undefined && Math.abs(at(event) - from) <= 0.01) this.all();
      from = undefined;
    });
  }

  private drag(a: number, b: number): void {
    const { range: [low, high] } = this.of;
    const from = low + a * this.span, to = low + b * this.span;
    if (this.classes) this.select(Math.floor(from), Math.min(high, Math.floor(to)));
    else this.select(a <= 0.002 ? -Infinity : from, b >= 0.998 ? Infinity : to);
  }

  private typed(): void {
    const { range } = this.of;
    const [low, high] = range;
    const [from, to] = this.ends.map((input, k) => (input.value === number(range[k]!) ? range[k]! : input.valueAsNumber)) as [number, number];
    if (Number.isNaN(from) || Number.isNaN(to) || (from <= low && to >= high)) this.all();
    else this.select(from <= low ? -Infinity : from, to >= high ? Infinity : to);
  }

  private all(): void {
    this.band.setAttribute('width', '0');
    this.note.textContent = this.of.meaning;
    this.of.range.forEach((x, k) => { this.ends[k]!.value = number(x); });
    this.narrow();
  }

  /** Shows only what is from `from` to `to`; beyond the ends of the colours where these are infinite. */
  private select(from: number, to: number): void {
    const { range: [low, high], values } = this.of;
    const place = (x: number) => (Math.min(1, Math.max(0, (x - low) / this.span)) || 0) * kWidth;
    const left = place(from), right = place(this.classes ? to + 1 : to);
    this.band.setAttribute('x', String(left));
    this.band.setAttribute('width', String(Math.max(1, right - left)));
    [Math.max(low, from), Math.min(high, to)].forEach((x, k) => { this.ends[k]!.value = number(x); });
    const inside = values.reduce((n, x) => n + (x >= from && x <= to ? 1 : 0), 0);
    this.note.textContent = `${count(inside, 'vertex', 'vertices')} in this range. Click the histogram to show all.`;
    const margin = this.classes ? 0.25 : 0;
    this.narrow([Math.max(-1e30, from) - margin, Math.min(1e30, to) + margin]);
  }
}

function mixed(stops: string[], t: number): string {
  const at = t * (stops.length - 1);
  const low = Math.min(Math.floor(at), stops.length - 2);
  return `color-mix(in srgb, ${stops[low]!}, ${stops[low + 1]!} ${(100 * (at - low)).toFixed(0)}%)`;
}
