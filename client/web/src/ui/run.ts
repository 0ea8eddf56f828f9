import type { Progress } from 'creased-client';
import { fill, h, svg } from './dom';
import { number, seconds, stageWord } from './words';

interface Series {
  name: string;
  colour: string;
  values: number[];
}

const kWidth = 280, kHeight = 46;

/** A curve without axes: what matters is where it goes. */
function curve(title: string, series: Series[]): HTMLElement {
  const all = series.flatMap((one) => one.values);
  const low = Math.min(...all), high = Math.max(...all), span = high - low || 1;
  const path = (values: number[]) =>
    values.map((y, i) => `${i === 0 ? 'M' : 'L'}${((i / Math.max(1, values.length - 1)) * kWidth).toFixed(1)} ${(kHeight - 3 - ((y - low) / span) * (kHeight - 6)).toFixed(1)}`).join('');
  const last = series.map((one) => `${one.name} ${number(one.values.at(-1) ?? 0)}`).join(', ');
  return h('figure', { class: 'curve' },
    h('figcaption', {}, h('span', {}, title), h('span', { class: 'legend' },
      ...series.map((one) => h('span', { class: `key ${one.colour}` }, series.length > 1 ? one.name : number(one.values.at(-1) ?? 0))))),
    svg('svg', { viewBox: `0 0 ${kWidth} ${kHeight}`, role: 'img', 'aria-label': `${title}: ${last}`, preserveAspectRatio: 'none' },
      ...series.map((one) => svg('path', { d: path(one.values), class: one.colour }))) as unknown as Node);
}

/** How a job gets on: a bar, the time left, curves, and a way to stop it. */
export class RunCard {
  readonly element = h('section', { class: 'card run', 'aria-label': 'Progress', hidden: true });
  private readonly title = h('strong', {}, '');
  private readonly left = h('span', { class: 'quiet-text' });
  private readonly bar = h('progress', { max: 1, value: 0, 'aria-label': 'Progress of the job' });
  private readonly curves = h('div', { class: 'curves' });
  private readonly cancel: HTMLButtonElement;
  private past: Progress[] = [];
  private ridgeCounts: number[] = [];
  private drawn = 0;

  constructor(onCancel: () => Promise<void>) {
    const cancel = async () => {
      this.cancel.disabled = true;
      this.title.textContent = 'Stopping';
      await onCancel();
      this.cancel.disabled = false;
    };
    this.cancel = h('button', { type: 'button', class: 'button', onclick: () => void cancel() }, 'Cancel');
    const more = h('details', { class: 'more', open: window.innerWidth > 900 }, h('summary', {}, 'Curves'), this.curves);
    fill(this.element, h('div', { class: 'row' }, h('div', { class: 'grow' }, this.title, ' ', this.left), this.cancel), this.bar, more);
  }

  begin(words: string): void {
    this.past = [];
    this.ridgeCounts = [];
    this.element.hidden = false;
    this.title.textContent = words;
    this.left.textContent = '';
    this.bar.removeAttribute('value');
    this.cancel.hidden = false;
    this.element.querySelector('details')!.hidden = true;
  }

  uploading(sent: number, total: number): void {
    this.title.textContent = sent < total ? 'Uploading' : 'The service reads the mesh';
    if (sent < total) this.bar.value = sent / total;
    else this.bar.removeAttribute('value');
  }

  update(progress: Progress): void {
    this.title.textContent = stageWord(progress);
    if (progress.fraction > 0) this.bar.value = progress.fraction;
    else this.bar.removeAttribute('value');
    this.left.textContent = progress.eta_seconds >= 1 ? `about ${seconds(progress.eta_seconds)} left` : '';
    if (!progress.energy || progress.sweeps === 0) return;
    this.past.push(progress);
    if (performance.now() - this.drawn > 250) this.draw();
  }

  lost(): void {
    this.title.textContent = 'The connection is lost. Trying again';
    this.left.textContent = '';
  }

  ridges(count: number): void {
    this.ridgeCounts.push(count);
  }

  /** The job has ended, and there is nothing left to cancel. */
  loading(): void {
    this.element.hidden = false;
    this.title.textContent = 'Loading the result';
    this.left.textContent = '';
    this.bar.removeAttribute('value');
    this.cancel.hidden = true;
  }

  end(): void {
    this.element.hidden = true;
  }

  private draw(): void {
    this.drawn = performance.now();
    if (this.past.length < 2) return;
    this.element.querySelector('details')!.hidden = false;
    const of = (name: string, colour: string, get: (p: Progress) => number): Series => ({ name, colour, values: this.past.map(get) });
    const terms = [
      of('likelihood', 'c1', (p) => p.energy!.likelihood),
      of('smoothness', 'c2', (p) => p.energy!.smoothness),
      of('sharpness', 'c3', (p) => p.energy!.sharpness),
      of('support', 'c4', (p) => p.energy!.support),
    ].filter((one) => one.values.some((x) => x !== 0));
    const curves = [curve('Energy', terms)];
    if (this.past.some((p) => p.temperature !== 0)) curves.push(curve('Temperature', [of('temperature', 'c2', (p) => p.temperature)]));
    if (this.past.some((p) => p.acceptance !== 0)) curves.push(curve('Acceptance', [of('acceptance', 'c1', (p) => p.acceptance)]));
    if (this.ridgeCounts.length > 1 && this.ridgeCounts.some((n) => n > 0)) curves.push(curve('Ridge edges', [{ name: 'ridge edges', colour: 'c3', values: this.ridgeCounts }]));
    fill(this.curves, ...curves);
  }
}
