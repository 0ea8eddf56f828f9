import type { Surface } from '../mesh/surface';
import type { Colouring } from '../viewer/material';
import { fill, h } from './dom';
import { Histogram } from './histogram';
import { number } from './words';

/** Something to colour a mesh by. */
export interface Measure {
  name: string;
  unit: string;
  scale: Colouring['scale'];
  /** What the numbers are. */
  meaning: string;
  values: (surface: Surface) => Float32Array | undefined;
  /** What can be done when there are none. */
  missing?: { words: string; remedy?: string; act?: () => void };
}

/** Chooses what the mesh is coloured by; its histogram is the legend, and dragging over it selects. */
export class ColourPicker {
  readonly element = h('div', { class: 'colour-by' });
  private readonly select = h('select', { id: 'colour-by', onchange: () => this.choose(this.select.value) });
  private readonly legend = h('div', { class: 'legend-box' });
  private chosen = '';
  private values?: Float32Array;

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
    if (!measure || !values) {
      delete this.values;
      fill(this.legend, measure && h('span', { class: 'quiet-text' }, measure.missing?.words ?? 'This result does not have it.'),
        measure?.missing?.remedy && h('button', { type: 'button', class: 'button', onclick: measure.missing.act }, measure.missing.remedy));
      this.apply();
      return;
    }
    this.values = values;
    const { unit, meaning, scale } = measure;
    const range = scale === 'classes' ? extent(values) : robustRange(values, scale === 'diverging');
    this.apply({ values, range, scale });
    fill(this.legend, new Histogram({ name, unit, meaning, scale, values, range }, this.narrow).element);
  }

  /** What a vertex has of what the mesh is coloured by, in words. */
  valueAt(vertex: number): string | undefined {
    const value = this.values?.[vertex];
    return value === undefined ? undefined : `${this.chosen} ${number(value, 3)}`;
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
