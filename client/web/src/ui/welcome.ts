import type { Job } from 'creased-client';
import { h, icon, svg } from './dom';
import { count, stateWord } from './words';

export interface Ways {
  choose: () => void;
  paste: () => void;
  sample: (name: 'part.ply' | 'scan.ply') => void;
}

const partPicture = () =>
  svg('svg', { viewBox: '0 0 80 56', 'aria-hidden': 'true', class: 'sample-picture' },
    svg('path', { d: 'M14 34 27 25h26l13 9-13 9H27z', class: 'p1' }),
    svg('path', { d: 'M14 34v7l13 9h26l13-9v-7l-13 9H27z', class: 'p2' }),
    svg('path', { d: 'M26 14v18c0 4 6 7 14 7s14-3 14-7V14z', class: 'p2' }),
    svg('ellipse', { cx: 40, cy: 14, rx: 14, ry: 6.5, class: 'p1' }),
    svg('ellipse', { cx: 40, cy: 14, rx: 7, ry: 3.2, class: 'p3' }),
    svg('path', { d: 'M14 34 27 43h26l13-9M27 43v7M53 43v7', class: 'line' }));

const scanPicture = () =>
  svg('svg', { viewBox: '0 0 80 56', 'aria-hidden': 'true', class: 'sample-picture' },
    svg('path', { d: 'M38 14c-1-4-3-6-6-7l4-3c4 1 6 5 6 10z', class: 'p3' }),
    svg('ellipse', { cx: 40, cy: 32, rx: 27, ry: 19, class: 'p2' }),
    svg('ellipse', { cx: 40, cy: 32, rx: 17, ry: 19, class: 'p1' }),
    svg('ellipse', { cx: 40, cy: 32, rx: 7, ry: 19, class: 'p2' }));

/** The stage before there is a mesh on it. */
export function welcome(ways: Ways): HTMLElement {
  const card = (name: 'part.ply' | 'scan.ply', title: string, words: string, picture: Node) =>
    h('button', { type: 'button', class: 'sample', onclick: () => ways.sample(name) }, picture, h('strong', {}, title), h('span', { class: 'quiet-text' }, words));
  return h('div', { class: 'welcome', id: 'welcome' },
    h('h1', {}, 'Drop a mesh.'),
    h('p', { class: 'promise' }, 'It comes back without its noise, with its ridges kept sharp and drawn.'),
    h('div', { class: 'ways' },
      h('button', { type: 'button', class: 'button primary', onclick: ways.choose }, icon('open'), 'Choose a file'),
      h('button', { type: 'button', class: 'button', onclick: ways.paste }, icon('paste'), 'Paste')),
    h('p', { class: 'quiet-text' }, 'OBJ, PLY, OFF, STL, glTF or GLB. The mesh stays on this server and is deleted later.'),
    h('div', { class: 'samples' },
      h('p', { class: 'quiet-text' }, 'No mesh at hand?'),
      card('part.ply', 'A machined part', 'flat faces, sharp ridges', partPicture()),
      card('scan.ply', 'A scan', 'curved all over, a scanner’s noise', scanPicture())));
}

/** The jobs of before, to go on with. */
export function recent(jobs: readonly Job[], open: (job: Job) => void): HTMLElement {
  const one = (job: Job) => h('button', { type: 'button', class: 'text-button', onclick: () => open(job) },
    job.input.name || job.id, h('span', { class: 'quiet-text' }, ` ${count(job.input.faces, 'face')}, ${stateWord(job)}`));
  return h('div', { class: 'recent', hidden: jobs.length === 0 }, h('p', { class: 'quiet-text' }, 'Or go on with'), ...jobs.map(one));
}
