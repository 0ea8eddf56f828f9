import type { Client, Job, MeshFormat } from 'creased-client';
import { fill, h, icon } from './dom';

interface Choice {
  name: string;
  meaning: string;
  path: string;
  extension: string;
}
const kMeshes: [MeshFormat, string][] = [
  ['glb', 'with ridges, normals and labels'],
  ['ply', 'binary, double precision'],
  ['obj', 'text'],
  ['stl', 'binary, without connectivity'],
  ['off', 'text'],
  ['gltf', 'glTF as JSON'],
  ['json', 'for scripts'],
];

function choicesOf(job: Job): Choice[] {
  const self = `v1/jobs/${job.id}`;
  return [
    ...kMeshes.map(([format, meaning]) => ({ name: format.toUpperCase(), meaning, path: `${self}/mesh?format=${format}`, extension: `-smooth.${format}` })),
    { name: 'Labels, CSV', meaning: 'label and angle of every edge', path: `${self}/labels?format=csv`, extension: '-labels.csv' },
    { name: 'Labels, JSON', meaning: 'the same for scripts', path: `${self}/labels?format=json`, extension: '-labels.json' },
    { name: 'Ridges, JSON', meaning: 'ridge lines and corners', path: `${self}/ridges?format=json`, extension: '-ridges.json' },
    { name: 'Ridges, GLB', meaning: 'lines to look at', path: `${self}/ridges?format=glb`, extension: '-ridges.glb' },
    { name: 'Report', meaning: 'parameters, energies, timings', path: `${self}/report`, extension: '-report.json' },
  ];
}

/** Saves bytes as a file. */
export function save(blob: Blob, name: string): void {
  const url = URL.createObjectURL(blob);
  h('a', { href: url, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(url), 10_000);
}

export interface Takings {
  picture: () => Promise<void>;
  link: () => Promise<string>;
  failed: (error: unknown) => void;
}

/** Everything that can be taken away from a job. */
export function downloadsOf(client: Client, job: Job, takings: Takings): HTMLElement {
  const base = job.input.name.replace(/\.[^.]+$/, '') || 'mesh';
  const list = h('ul', { class: 'downloads' });
  fill(list, ...choicesOf(job).map((choice) => {
    const button = h('button', {
      type: 'button',
      onclick: async () => {
        button.disabled = true;
        try {
          save(await client.file(client.url(choice.path.split('?')[0]!, Object.fromEntries(new URLSearchParams(choice.path.split('?')[1])))), base + choice.extension);
        } catch (error) {
          takings.failed(error);
        } finally {
          button.disabled = false;
        }
      },
    }, icon('down'), h('span', {}, choice.name), h('span', { class: 'quiet-text' }, choice.meaning));
    return h('li', {}, button);
  }));
  const copied = h('span', { class: 'quiet-text', role: 'status' });
  const linkButton = h('button', {
    type: 'button', class: 'button',
    onclick: async () => {
      const link = await takings.link();
      await navigator.clipboard.writeText(link).catch(() => undefined);
      copied.textContent = 'The link is copied.';
    },
  }, icon('link'), 'Link to this job');
  return h('div', {}, list, h('div', { class: 'row wrap' },
    h('button', { type: 'button', class: 'button', onclick: takings.picture }, icon('camera'), 'Picture'), linkButton, copied));
}
