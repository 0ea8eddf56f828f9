import type { CreasedError, Job, Problem, Progress } from 'creased-client';

const thousands = new Intl.NumberFormat('en');

export const whole = (n: number): string => thousands.format(n);
export const count = (n: number, one: string, many = `${one}s`): string => `${whole(n)} ${n === 1 ? one : many}`;
export const number = (x: number, digits = 3): string => {
  if (x === 0) return '0';
  const size = Math.abs(x);
  if (size >= 1e5 || size < 1e-4) return x.toExponential(Math.max(0, digits - 1)).replace('e+', 'e');
  return Number(x.toPrecision(digits)).toString();
};
/** The name of a parameter as words. */
export const parameterWords = (name: string): string => {
  const text = name.replace(/_deg$/, '').replaceAll('_', ' ');
  return text.charAt(0).toUpperCase() + text.slice(1);
};
/** A description by the service with names of parameters and values as the form has them. */
export const descriptionWords = (text: string): string => text.replace(/\b[a-z]+(_[a-z]+)+\b/g, (name) => parameterWords(name).toLowerCase());
export const percent = (x: number): string => `${number(100 * x, 2)} %`;

export function seconds(s: number): string {
  if (s < 1) return 'under a second';
  if (s < 90) return `${Math.round(s)} s`;
  return `${Math.floor(s / 60)} min ${Math.round(s % 60)} s`;
}

export function bytes(n: number): string {
  if (n < 1000) return `${n} bytes`;
  const units = ['kB', 'MB', 'GB'];
  const power = Math.min(3, Math.floor(Math.log10(n) / 3));
  return `${number(n / 1000 ** power, 3)} ${units[power - 1]}`;
}

export interface Finding {
  tone: 'plain' | 'good' | 'care';
  text: string;
}

/** What the service found in an upload, in words. */
export function findings({ input, warnings }: Job): Finding[] {
  const found: Finding[] = [];
  const say = (tone: Finding['tone'], text: string) => found.push({ tone, text });
  say('plain', `${count(input.vertices, 'vertex', 'vertices')} and ${count(input.faces, 'face')} in ${count(input.components, 'piece')}.`);
  if (input.boundary_edges === 0 && input.nonmanifold_edges === 0) say('good', 'Closed: every edge lies between two faces.');
  else if (input.boundary_edges > 0) say('plain', `Open: ${count(input.boundary_edges, 'boundary edge')}. It stays open.`);
  for (const { code, detail } of warnings) {
    const [tone, text] = kWarnings[code]?.(input) ?? ['care', sentence(detail)];
    say(tone, text);
  }
  return found;
}

type Words = [Finding['tone'], string];

/** The usual warnings in words of the page. The others are shown as the service says them. */
const kWarnings: Record<string, (input: Job['input']) => Words> = {
  nonmanifold_edges: ({ nonmanifold_edges: n }) => ['care', `${count(n, 'edge lies', 'edges lie')} between more than two faces. Nothing is smoothed across ${n === 1 ? 'it' : 'them'}.`],
  degenerate_faces: ({ degenerate_faces: n }) => ['care', `${count(n, 'face has', 'faces have')} no area, and ${n === 1 ? 'comes' : 'come'} back as ${n === 1 ? 'it is' : 'they are'}.`],
  duplicate_faces: ({ duplicate_faces: n }) => ['care', `${count(n, 'face is', 'faces are')} there more than once: smoothed as one, and all are kept.`],
  inconsistent_winding: ({ flipped_faces: n }) => ['care', `${count(n, 'face points', 'faces point')} the other way than the neighbours: smoothed as if turned, and kept as ${n === 1 ? 'it is' : 'they are'}.`],
  isolated_vertices: ({ isolated_vertices: n }) => ['plain', `${count(n, 'vertex belongs', 'vertices belong')} to no face, and ${n === 1 ? 'stays' : 'stay'} in place.`],
  vertices_welded: ({ coincident_vertices: n }) => ['plain', `${count(n, 'vertex lies', 'vertices lie')} exactly on another: they move as one, and all are kept.`],
  attributes_dropped: ({ attributes, format }) => ['plain',
    `Beside its surface the file has: ${attributes.join(', ')}. The download as ${format.toUpperCase()} keeps all of it, other formats what they have a place for.`],
};

/** How strong the noise is. What is seen at first sight is a number only: the word waits for the job, which knows better. */
export function noiseWords({ input, result }: Job): [words: string, figure: string] {
  if (!result?.choice) return [`Noise: about ${number(input.noise_sigma, 2)} edge lengths`, 'at first sight'];
  const first = input.noise_sigma, sigma = result.choice.noise_sigma;
  return [`Noise: ${noiseWord(sigma)}`, `${number(sigma, 2)} edge lengths${isOther(first, sigma) ? `; ${number(first, 2)} at first sight` : ''}`];
}

// Estimates that differ by less are the same to the eye.
const kOther = 1.3;
const isOther = (first: number, sigma: number): boolean => Math.max(first, sigma) > 0.01 && Math.max(first / sigma, sigma / first) > kOther;

function noiseWord(sigma: number): string {
  if (sigma < 0.01) return 'hardly any';
  if (sigma < 0.08) return 'a little';
  if (sigma < 0.2) return 'clearly there';
  return sigma < 0.45 ? 'strong' : 'very strong';
}

const kSurfaces: Record<string, string> = {
  creases: 'flat faces that meet in sharp ridges',
  curved_creases: 'curved faces that meet in sharp ridges',
  flats: 'flat faces that meet at any angle',
  organic: 'a surface that is curved all over',
};

/** What the automatic setting estimated and chose, as sentences. */
export function choiceWords(job: Job): string[] {
  const choice = job.result?.choice;
  if (!choice) return [];
  const words: string[] = [];
  if (choice.noise_sigma < 0.005) words.push('There is no noise to speak of.');
  else {
    let noise = `The noise is about ${number(choice.noise_sigma, 2)} edge lengths`;
    if (choice.correlation_length > 0) noise += `, correlated over ${number(choice.correlation_length, 2)} edges as a scanner's is`;
    else if (choice.noise === 'normal') noise += ', along the surface normals';
    else if (choice.noise === 'isotropic') noise += ', alike in all directions';
    if (choice.impulsive) noise += `, at ${percent(choice.moved_share)} of the vertices`;
    if (choice.varying) noise += ', stronger in some places than in others';
    words.push(`${noise}.`);
    if (choice.correlation_length > 0 && isOther(job.input.noise_sigma, choice.noise_sigma)) {
      words.push(`At first sight it was ${number(job.input.noise_sigma, 2)}: what neighbouring vertices have in common shows only beside a smoothed surface.`);
    }
  }
  if (choice.spikes > 0) words.push(`${count(choice.spikes, 'vertex stuck out as a spike and was', 'vertices stuck out as spikes and were')} flattened.`);
  const kind = kSurfaces[choice.surface];
  if (kind) words.push(`The mesh was taken for ${kind}.`);
  const tried = choice.candidates.length;
  if (tried > 1) words.push(`Of ${count(tried, 'setting')}, the one with the smallest expected error was taken.${otherKinds(choice)}`);
  return words;
}

type Choice = NonNullable<NonNullable<Job['result']>['choice']>;

/** How much worse another kind of surface would have been. */
function otherKinds({ surface, margin, candidates }: Choice): string {
  const other = candidates.find((one) => one.surface !== surface && one.surface in kSurfaces);
  if (!other || margin <= 0) return '';
  return ` For ${kSurfaces[other.surface]} it would have been about ${percent(margin)} larger.`;
}

export function stateWord(job: Job): string {
  return { queued: 'waiting', running: 'running', succeeded: 'done', failed: 'failed', cancelled: 'cancelled' }[job.state];
}

const kStages: Record<string, string> = {
  queued: 'Waiting for its turn',
  checking: 'Checking the mesh',
  smoothing: 'Smoothing',
  encoding: 'Writing the result',
  done: 'Done',
};
export function stageWord({ stage, sweep }: Progress): string {
  if (stage === 'smoothing' && sweep === 0) return 'Looking at the noise';
  return kStages[stage] ?? 'Smoothing';
}

const sentence = (text: string): string => {
  const capital = text.charAt(0).toUpperCase() + text.slice(1);
  return /[.!?]$/.test(capital) ? capital : `${capital}.`;
};

const kOtherFormat = /^declared as (\w+), but the bytes look like (\w+)$/;

/** What is wrong, by what the service says of it. */
function faultWords({ title, detail, field, value, expected }: Problem): string {
  const [, called, found] = detail?.match(kOtherFormat) ?? [];
  if (called && found) return `The file is named as ${called.toUpperCase()}, but what is in it looks like ${found.toUpperCase()}. Rename it to end in .${found}`;
  if (field && value && expected) return `${parameterWords(field)} is ${value}; expected is ${expected}`;
  return detail || title;
}

// The place of errors that are about the whole file.
const kStartOfFile = 'byte 0';

/** An error of the service, as someone who does not know the API wants to read it. */
export function errorWords(error: CreasedError): string {
  const { problem } = error;
  if (!problem) return sentence(error.message);
  const where = problem.place && problem.place !== kStartOfFile ? ` (${problem.place})` : '';
  const wait = error.retryAfter ? ` Try again in ${seconds(error.retryAfter)}.` : '';
  return sentence(`${faultWords(problem)}${where}`) + wait;
}
