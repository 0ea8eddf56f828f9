import { labelFormats, meshFormats, reportFormats, ridgeFormats, type Client, type Job } from 'creased-client';
import { fill, h, icon } from './dom';

const kMeanings: Record<string, string> = {
  'mesh.original': 'the format of the upload, with all else that it had',
  'mesh.glb': 'with ridges, normals and labels',
  'mesh.ply': 'binary, double precision, with labels',
  'mesh.obj': 'text',
  'mesh.stl': 'binary, without connectivity',
  'mesh.off': 'text',
  'mesh.gltf': 'glTF as JSON',
  'mesh.json': 'for scripts',
  'labels.csv': 'label and angle of every edge',
  'labels.json': 'the same for scripts',
  'ridges.json': 'ridge lines and corners',
  'ridges.glb': 'lines to look at',
  'report.json': 'parameters, energies, timings',
};
const kParts: [part: string, formats: readonly string[]][] = [
  ['mesh', meshFormats],
  ['labels', labelFormats],
  ['ridges', ridgeFormats],
  ['report', reportFormats],
];

/** Saves bytes as a file. */
export function save(file: File): void {
  const url = URL.createObjectURL(file);
  h('a', { href: url, download: file.name }).click();
  setTimeout(() => URL.revokeObjectURL(url), 10_000);
}

export interface Takings {
  picture: () => Promise<void>;
  link: () => Promise<string>;
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
  const file = (part: string, format: string) => {
    const name = `${part}.${format}`;
    const title = part === 'mesh' ? (format === 'original' ? 'Original' : format.toUpperCase()) : `${part.charAt(0).toUpperCase()}${part.slice(1)}, ${format.toUpperCase()}`;
    const work = async () => save(await client.file(`v1/jobs/${job.id}/${name}`));
    return h('li', {}, busyButton(work, failed, {}, icon('down'), h('span', {}, title), h('span', { class: 'quiet-text' }, kMeanings[name] ?? (format === 'pb' ? 'a protobuf message' : ''))));
  };
  const copied = h('span', { class: 'quiet-text', role: 'status' });
  const copy = async () => {
    const address = await link();
    const done = await navigator.clipboard.writeText(address).then(() => true, () => false);
    fill(copied, done ? 'The link is copied.' : h('a', { href: address }, 'The link'));
  };
  return h('div', {},
    h('ul', { class: 'downloads' }, ...kParts.flatMap(([part, formats]) => formats.map((format) => file(part, format)))),
    h('div', { class: 'row wrap' }, busyButton(picture, failed, { class: 'button' }, icon('camera'), 'Picture'),
      busyButton(copy, failed, { class: 'button' }, icon('link'), 'Link to this job'), copied));
}
