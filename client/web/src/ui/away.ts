import { labelFormats, meshFormats, reportFormats, ridgeFormats, type Client, type Job, type LinkQuery } from 'creased-client';
import { fill, h, icon } from './dom';

const kMeanings: Record<string, string> = {
  'mesh.original': 'your file, with all else that is in it; only positions and normals are new',
  'mesh.glb': 'with ridges, normals and labels',
  'mesh.ply': 'binary, double precision, with labels',
  'mesh.obj': 'text',
  'mesh.stl': 'binary, without connectivity',
  'mesh.off': 'text',
  'mesh.gltf': 'glTF as JSON',
  'mesh.json': 'for scripts',
  'labels.json': 'label and angle of every edge',
  'labels.csv': 'the same as a table',
  'ridges.json': 'ridge lines and corners',
  'ridges.glb': 'lines to look at',
  'report.json': 'parameters, energies, timings',
};
type Format = NonNullable<LinkQuery['format']>;
const kParts: [part: LinkQuery['result'], formats: readonly Format[]][] = [
  ['mesh', ['original', ...meshFormats.filter((format) => format !== 'original')]],
  ['labels', labelFormats],
  ['ridges', ridgeFormats],
  ['report', reportFormats],
];

/** Saves bytes of the page as a file. */
export function save(file: File): void {
  const url = URL.createObjectURL(file);
  h('a', { href: url, download: file.name }).click();
  setTimeout(() => URL.revokeObjectURL(url), 10_000);
}

// The browser saves what a link reads by itself, without the page holding it, and under the name that the service gives.
const kLinkSeconds = 60;
async function saveFromService(client: Client, job: Job, query: LinkQuery): Promise<void> {
  const { url } = await client.link(job.id, { ...query, expires_in: kLinkSeconds });
  h('a', { href: url, download: '' }).click();
}

export interface Takings {
  picture: () => Promise<void>;
  /** An address that shows the job, and what there is to say of it. */
  link: () => Promise<{ address: string; words: string }>;
  failed: (error: unknown) => void;
}

/** A button that is out of use while it works. */
function busyButton(work: () => Promise<void>, failed: (error: unknown) => void, attributes: Record<string, unknown>, ...children: (Node | string)[]): HTMLButtonElement {
  const button = h('button', {
    type: 'button', ...attributes,
    onclick: async () => {
      button.disabled = true;
      await work().catch(failed);
      button.disabled = false;
    },
  }, ...children);
  return button;
}

/** Everything that can be taken away from a job: each part of it in each format, a picture, a link. */
export function downloadsOf(client: Client, job: Job, { picture, link, failed }: Takings): HTMLElement {
  const file = (part: LinkQuery['result'], format: Format) => {
    const name = `${part}.${format}`;
    const title = part === 'mesh' ? (name === 'mesh.original' ? 'Original' : format.toUpperCase()) : `${part.charAt(0).toUpperCase()}${part.slice(1)}, ${format.toUpperCase()}`;
    const work = () => saveFromService(client, job, { result: part, format });
    return h('li', {}, busyButton(work, failed, {}, icon('down'), h('span', {}, title), h('span', { class: 'quiet-text' }, kMeanings[name] ?? (format === 'pb' ? 'a protobuf message' : ''))));
  };
  const copied = h('span', { class: 'quiet-text', role: 'status' });
  const copy = async () => {
    const { address, words } = await link();
    const done = await navigator.clipboard.writeText(address).then(() => true, () => false);
    fill(copied, done ? 'Copied. ' : h('a', { href: address }, 'The link. '), words);
  };
  return h('div', {},
    h('ul', { class: 'downloads' }, ...kParts.flatMap(([part, formats]) => formats.map((format) => file(part, format)))),
    h('div', { class: 'row wrap' }, busyButton(picture, failed, { class: 'button' }, icon('camera'), 'Picture'),
      busyButton(copy, failed, { class: 'button' }, icon('link'), 'Link to this job'), copied));
}

/** The upload with its positions smoothed, in the format in which it came, and the way to all others. */
export function quickDownload(client: Client, job: Job, failed: Takings['failed'], others: () => void): HTMLElement {
  const work = () => saveFromService(client, job, { result: 'mesh', format: 'original' });
  return h('div', { class: 'row' },
    busyButton(work, failed, { class: 'button primary', title: kMeanings['mesh.original'] }, icon('down'), `Download ${job.input.format.toUpperCase()}`),
    h('button', { type: 'button', class: 'text-button', onclick: others }, 'Other formats'));
}
