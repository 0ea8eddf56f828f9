import type { Parameters } from 'creased-client';
import { fill, h } from './dom';
import { descriptionWords, parameterWords } from './words';

export type Value = string | number | boolean;
export type Values = Record<string, Value>;

/** One row of GET /v1/parameters. */
export interface Row {
  type: 'string' | 'number' | 'integer' | 'boolean';
  enum?: string[];
  minimum?: number;
  maximum?: number;
  default?: Value;
  description: string;
  'x-group': string;
  'x-unit'?: string;
  'x-applies'?: Record<string, string[]>;
  'x-defaults'?: Record<string, Value>;
  'x-ranges'?: Record<string, { minimum: number; maximum: number }>;
}
export type Schema = { properties: Record<string, Row> };

interface Preset {
  name: string;
  values: Values;
  meaning: string;
}
const kPresets: Preset[] = [
  { name: 'Automatic', values: {}, meaning: 'Noise, kind of surface and weight are estimated from the mesh.' },
  { name: 'Gentle', values: { strength: 0.5 }, meaning: 'Half of what the estimated noise asks for.' },
  { name: 'Thorough', values: { strength: 1.5 }, meaning: 'More than the estimated noise asks for.' },
  { name: 'Machined part', values: { surface: 'creases' }, meaning: 'Flat faces with sharp ridges, whatever the estimate says.' },
  { name: 'Scan of something organic', values: { surface: 'organic', noise: 'correlated' }, meaning: 'Curved all over, with the noise of a scanner.' },
  { name: 'Sampler of the paper', values: { solver: 'metropolis' }, meaning: 'The Metropolis sampler of Andersen et al. (2010). Slower.' },
  { name: 'Bilateral filter', values: { method: 'bilateral' }, meaning: 'A classical method, for comparison. It finds no ridges.' },
];
const kFront = 'strength';
const kFrontGroups = ['Automatic setting', 'Job'];

/** The parameters of the next job as a form. Only what differs from the default is sent. */
export class ParameterForm {
  readonly element = h('div', { class: 'parameters' });
  private values: Values = {};
  private readonly front = h('div', { class: 'front' });
  private readonly rest = h('div', { class: 'groups' });
  private readonly presets = h('select', { 'aria-label': 'Preset', onchange: () => this.takePreset() });
  private readonly note = h('p', { class: 'note' });
  private readonly errors = new Map<string, string>();
  private openGroups = new Set(kFrontGroups);

  constructor(
    private readonly schema: Schema,
    private readonly changed: () => void,
  ) {
    fill(
      this.presets,
      ...kPresets.map((preset) => h('option', { value: preset.name }, preset.name)),
      h('option', { value: '', disabled: true }, 'Own values'),
    );
    const reset = h('button', { type: 'button', class: 'text-button', onclick: () => this.set({}) }, 'Reset');
    fill(
      this.element,
      this.front,
      h('label', { class: 'field row' }, h('span', {}, 'Preset'), this.presets),
      this.note,
      h('details', { class: 'all' }, h('summary', {}, 'All parameters', reset), this.rest),
    );
    this.draw();
  }

  get parameters(): Parameters {
    return { ...this.values } as Parameters;
  }

  set(values: Values): void {
    this.values = { ...values };
    this.errors.clear();
    this.draw();
    this.changed();
  }

  /** Shows an error of the service at the parameter that it is about. Returns whether there is one. */
  refuse(field: string, text: string): boolean {
    if (!(field in this.schema.properties)) return false;
    this.errors.set(field, text);
    this.openGroups.add(this.schema.properties[field]!['x-group']);
    this.element.querySelector('details.all')!.setAttribute('open', '');
    this.draw();
    return true;
  }

  private takePreset(): void {
    const preset = kPresets.find((one) => one.name === this.presets.value);
    if (preset) this.set(preset.values);
  }

  private current(name: string): Value | undefined {
    const row = this.schema.properties[name];
    return this.values[name] ?? row?.default ?? row?.['x-defaults']?.[String(this.values['method'] ?? 'mrf')];
  }

  private applies(row: Row): boolean {
    return Object.entries(row['x-applies'] ?? {}).every(([name, allowed]) => {
      const other = this.schema.properties[name];
      return other !== undefined && this.applies(other) && allowed.includes(String(this.current(name)));
    });
  }

  /** Whether a parameter has an effect with the others as they are. */
  allows(name: string): boolean {
    const row = this.schema.properties[name];
    return row !== undefined && this.applies(row);
  }

  change(name: string, value: Value | undefined): void {
    const row = this.schema.properties[name]!;
    this.errors.delete(name);
    if (value === undefined || value === row.default) delete this.values[name];
    else this.values[name] = value;
    // What has lost its meaning goes too; what is left out is never sent without being seen.
    for (const other of Object.keys(this.values)) {
      if (!this.applies(this.schema.properties[other]!)) delete this.values[other];
    }
    if (row.enum || row.type === 'boolean') this.draw();
    else this.drawPreset();
    this.changed();
  }

  private drawPreset(): void {
    const same = (preset: Preset) => JSON.stringify(preset.values) === JSON.stringify(this.values);
    const preset = kPresets.find(same);
    this.presets.value = preset?.name ?? '';
    this.note.textContent = preset?.meaning ?? `${Object.keys(this.values).length} of your own: ${Object.keys(this.values).map(parameterWords).join(', ').toLowerCase()}.`;
  }

  private draw(): void {
    this.drawPreset();
    const front = this.schema.properties[kFront];
    fill(this.front, front && this.applies(front) && this.strength(front));
    const groups = new Map<string, HTMLElement[]>();
    for (const [name, row] of Object.entries(this.schema.properties)) {
      if (name === kFront || !this.applies(row)) continue;
      const fields = groups.get(row['x-group']) ?? [];
      fields.push(this.field(name, row));
      groups.set(row['x-group'], fields);
    }
    const order = [...groups.keys()].sort((a, b) => rank(a) - rank(b));
    fill(
      this.rest,
      ...order.map((group) => {
        const details = h('details', { class: 'group', open: this.openGroups.has(group) }, h('summary', {}, group), ...groups.get(group)!);
        details.addEventListener('toggle', () => this.openGroups[details.open ? 'add' : 'delete'](group));
        return details;
      }),
    );
  }

  private strength(row: Row): HTMLElement {
    const value = Number(this.current(kFront));
    const output = h('output', { for: 'strength' }, strengthWord(value));
    const slider = h('input', {
      id: 'strength', type: 'range', min: row.minimum, max: row.maximum, step: 0.05, value,
      'aria-describedby': 'strength-note',
      oninput: () => {
        output.textContent = strengthWord(Number(slider.value));
        this.change(kFront, Number(slider.value));
      },
    });
    slider.value = String(value);
    return h('div', { class: 'field strength' },
      h('div', { class: 'row' }, h('label', { for: 'strength' }, 'Strength'), output),
      slider,
      h('div', { class: 'ends', id: 'strength-note' }, h('span', {}, 'as measured'), h('span', {}, 'as estimated'), h('span', {}, 'twice')));
  }

  private field(name: string, row: Row): HTMLElement {
    const id = `p-${name}`, error = this.errors.get(name);
    const range = row['x-ranges']?.[String(this.current('method'))] ?? row;
    const unit = row['x-unit'];
    const limits = range.minimum === undefined ? '' : `${range.minimum} to ${range.maximum}`;
    const input = this.input(name, row, id, range, error);
    return h('div', { class: `field${name in this.values ? ' changed' : ''}${error ? ' wrong' : ''}` },
      h('div', { class: 'row' }, h('label', { for: id, title: name }, parameterWords(name)), input),
      h('p', { class: 'hint', id: `${id}-hint` }, descriptionWords(row.description), limits && ` ${limits}${unit ? ` ${unit}` : ''}.`),
      error && h('p', { class: 'error', id: `${id}-error`, role: 'alert' }, error));
  }

  private input(name: string, row: Row, id: string, range: { minimum?: number; maximum?: number }, error?: string): HTMLElement {
    const value = this.current(name);
    const about = `${id}-hint${error ? ` ${id}-error` : ''}`;
    if (row.type === 'boolean') {
      const box = h('input', { id, type: 'checkbox', checked: value === true, 'aria-describedby': about, onchange: () => this.change(name, box.checked) });
      return box;
    }
    if (row.enum) {
      const select = h('select', { id, 'aria-describedby': about, onchange: () => this.change(name, select.value) },
        ...row.enum.map((word) => h('option', { value: word, selected: word === value }, word.replaceAll('_', ' '))));
      return select;
    }
    const field = h('input', {
      id, type: 'number', min: range.minimum, max: range.maximum, step: row.type === 'integer' ? 1 : 'any', value,
      inputmode: 'decimal', 'aria-describedby': about, 'aria-invalid': error !== undefined,
      oninput: () => this.change(name, field.value === '' ? undefined : field.valueAsNumber),
    });
    return field;
  }
}

const rank = (group: string): number => {
  const at = kFrontGroups.indexOf(group);
  return group === 'Job' ? 99 : at < 0 ? 50 : at;
};

function strengthWord(value: number): string {
  if (value === 1) return '1, as estimated';
  if (value === 0) return '0, nothing changes';
  return value.toFixed(2).replace(/0$/, '');
}
