import type { Job, RidgeLines } from 'creased-client';
import { fill, h } from './dom';
import { choiceWords, count, findings, noiseWords, number, parameterWords, percent, seconds, stateWord, whole } from './words';

type RidgeLine = RidgeLines['ridges'][number];

const row = (name: string, value: string, other?: string): HTMLElement =>
  h('tr', {}, h('th', { scope: 'row' }, name), h('td', {}, value), other !== undefined && h('td', {}, other));

/** What the service found in the upload. */
export function factsOf(job: Job): HTMLElement {
  const [words, figure] = noiseWords(job);
  return h('div', { class: 'facts' },
    h('p', {}, h('strong', {}, words), h('span', { class: 'quiet-text' }, ` (${figure})`)),
    h('ul', { class: 'findings' }, ...findings(job).map((one) => h('li', { class: one.tone }, one.text))));
}

const edges = (x: number): string => `${number(x, 2)} ${number(x, 2) === '1' ? 'edge' : 'edges'}`;

type Figure = [name: string, value: (job: Job) => string];
const kFigures: Figure[] = [
  ['Ridge edges', (job) => whole(job.result!.ridge_edges)],
  ['Ridge lines', (job) => whole(job.result!.ridge_lines)],
  ['Corners', (job) => whole(job.result!.corners)],
  ['Smooth segments', (job) => whole(job.result!.segments)],
  ['Length of ridges', (job) => `${number(job.result!.ridge_length, 4)} units`],
  ['Moved, typically', (job) => edges(job.result!.rms_displacement)],
  ['Moved, at most', (job) => edges(job.result!.max_displacement)],
  ['Volume', (job) => job.input.boundary_edges > 0 ? 'open' : `${job.result!.volume_change >= 0 ? '+' : '−'}${percent(Math.abs(job.result!.volume_change))}`],
  ['Time', (job) => job.result!.seconds < 10 ? `${number(job.result!.seconds, 2)} s` : seconds(job.result!.seconds)],
];

const shown = (value: unknown): string => (value === undefined ? '–' : typeof value === 'number' ? number(value, 4) : String(value).replaceAll('_', ' '));

/** The parameters in which two jobs differ, those of the first on the left. */
function differences(first: Job, second: Job): HTMLElement[] {
  const left = first.parameters as Record<string, unknown>, right = second.parameters as Record<string, unknown>;
  return [...new Set([...Object.keys(left), ...Object.keys(right)])]
    .filter((name) => JSON.stringify(left[name]) !== JSON.stringify(right[name]))
    .map((name) => row(parameterWords(name), shown(left[name]), shown(right[name])));
}

/** The figures of a result, beside those of another where there is one. */
export function figuresOf(job: Job, other?: Job): HTMLElement {
  if (!job.result) return h('p', {}, `This job is ${stateWord(job)}.`);
  const table = h('table', { class: 'figures' },
    other && h('thead', {}, h('tr', {}, h('td', {}), h('th', { scope: 'col' }, 'left'), h('th', { scope: 'col' }, 'right'))),
    other && h('tbody', {}, ...differences(other, job)),
    h('tbody', {}, ...kFigures.map(([name, value]) => (other?.result ? row(name, value(other), value(job)) : row(name, value(job))))));
  const words = choiceWords(job);
  return h('div', {}, table, words.length > 0 && h('div', { class: 'choice' }, h('h3', {}, 'What the automatic setting chose'), ...words.map((text) => h('p', {}, text))));
}

const kLinesShown = 200;

/** The ridge lines as a list; hovering one lights it up. */
export class RidgeList {
  readonly element = h('div', { class: 'ridge-list' });

  constructor(private readonly light: (vertices?: readonly number[], closed?: boolean) => void) {}

  show(ridges?: RidgeLines, shown = kLinesShown): void {
    if (!ridges || ridges.count === 0) return fill(this.element, h('p', { class: 'quiet-text' }, 'No ridges.'));
    const longest = [...ridges.ridges].sort((a, b) => b.length - a.length);
    const most = longest[0]!.length;
    const left = longest.length - shown;
    fill(this.element,
      h('p', { class: 'quiet-text' }, `${count(ridges.count, 'line')}, ${count(ridges.corners.length, 'corner')}. Lengths in the mesh's own units, the longest first.`),
      h('ol', {}, ...longest.slice(0, shown).map((line) => h('li', {}, this.line(line, most)))),
      left > 0 && h('button', { type: 'button', class: 'text-button', onclick: () => this.show(ridges, Infinity) }, `Show ${count(left, 'shorter one')}`));
  }

  private line(line: RidgeLine, longest: number): HTMLElement {
    const on = () => this.light(line.vertices, line.closed);
    const off = () => this.light();
    const angle = `${number(Math.abs(line.mean_dihedral_deg), 3)}° ${line.mean_dihedral_deg >= 0 ? 'convex' : 'concave'}`;
    const bar = h('span');
    bar.style.width = `${(100 * line.length) / longest}%`;
    return h('button', { type: 'button', onpointerenter: on, onpointerleave: off, onfocus: on, onblur: off },
      h('span', { class: 'length' }, number(line.length, 4)),
      h('span', { class: 'bar-of' }, bar),
      h('span', { class: 'quiet-text' }, line.closed ? `${angle}, closed` : angle));
  }
}
