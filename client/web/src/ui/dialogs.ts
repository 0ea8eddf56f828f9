import { CreasedError, type Client, type Job } from 'creased-client';
import { h, iconButton } from './dom';
import { count, errorWords, parameterWords, stateWord } from './words';

/** A window over the page, which closes by its button, by Escape, or by a click beside it. */
export function openDialog(title: string, ...content: Node[]): HTMLDialogElement {
  const dialog = h('dialog', { 'aria-labelledby': 'dialog-title' },
    h('div', { class: 'row' }, h('h2', { id: 'dialog-title', class: 'grow' }, title), iconButton('close', 'Close', () => dialog.close())),
    ...content);
  dialog.addEventListener('click', (event) => {
    if (event.target === dialog) dialog.close();
  });
  dialog.addEventListener('close', () => dialog.remove());
  document.body.append(dialog);
  dialog.showModal();
  return dialog;
}

/** Asks for the key. The answer is undefined when the window is closed without one. */
export function askForKey(wrong: boolean): Promise<string | undefined> {
  return new Promise((resolve) => {
    const input = h('input', { id: 'key', type: 'password', autocomplete: 'off', required: true, spellcheck: 'false' });
    let key: string | undefined;
    const form = h('form', { method: 'dialog', onsubmit: () => { key = input.value.trim(); } },
      h('p', {}, 'This service asks who you are. The key is kept until you close this tab, and sent to this service only.'),
      wrong && h('p', { class: 'error', role: 'alert' }, 'That key is not valid here.'),
      h('div', { class: 'field' }, h('label', { for: 'key' }, 'Key'), input),
      h('button', { class: 'button primary' }, 'Use this key'));
    const dialog = openDialog('Key', form);
    dialog.addEventListener('close', () => resolve(key));
    input.focus();
  });
}

/** Takes a mesh as text. */
export function askForText(): Promise<string | undefined> {
  return new Promise((resolve) => {
    const area = h('textarea', { id: 'pasted', rows: 10, spellcheck: 'false', placeholder: 'v 0 0 0\nv 1 0 0\n…' });
    let text: string | undefined;
    const form = h('form', { method: 'dialog', onsubmit: () => { text = area.value; } },
      h('div', { class: 'field' }, h('label', { for: 'pasted' }, 'A mesh as OBJ, OFF, PLY or STL text'), area),
      h('button', { class: 'button primary' }, 'Smooth this'));
    const dialog = openDialog('Paste a mesh', form);
    dialog.addEventListener('close', () => resolve(text || undefined));
    area.focus();
  });
}

const kJobsPerPage = 50;
const kDate = new Intl.DateTimeFormat(undefined, { dateStyle: 'medium', timeStyle: 'short' });

const nameOf = (job: Job): string => job.input.name || job.id;

/** A job as a button: its name, how it is, and `about`. */
const jobButton = (job: Job, about: string, onclick: () => void): HTMLElement =>
  h('button', { type: 'button', class: 'grow job', onclick },
    h('strong', {}, nameOf(job)), h('span', { class: `state ${job.state}` }, stateWord(job)), h('span', { class: 'quiet-text' }, about));

const sizeAndDate = (job: Job): string => `${count(job.input.faces, 'face')}, ${kDate.format(new Date(job.created_at))}`;

/** A window with jobs of this caller, page by page, each as `item` makes it; it may leave one out. */
async function listJobs(client: Client, title: string, query: { state?: Job['state'] }, item: (job: Job) => HTMLElement | undefined, first: (job: Job) => boolean = () => false): Promise<HTMLDialogElement> {
  const list = h('ul', { class: 'jobs' });
  const note = h('p', { class: 'quiet-text', role: 'status' }, 'Asking the service…');
  const more = h('button', { type: 'button', class: 'button', hidden: true, onclick: () => void add() }, 'Older jobs');
  const dialog = openDialog(title, list, note, more);
  let cursor: string | undefined;
  const add = async () => {
    const page = await client.jobs({ limit: kJobsPerPage, ...query, ...(cursor ? { cursor } : {}) });
    const jobs = [...page.jobs].sort((a, b) => Number(first(b)) - Number(first(a)));
    list.append(...jobs.map(item).filter((one) => one !== undefined));
    cursor = page.next_cursor || undefined;
    more.hidden = !cursor;
    note.textContent = list.children.length > 0 ? '' : 'None yet.';
  };
  await add().catch((error: unknown) => {
    dialog.close();
    throw error;
  });
  return dialog;
}

const refusal = (error: unknown): HTMLElement =>
  h('span', { class: 'error', role: 'alert' }, error instanceof CreasedError ? errorWords(error) : String(error));

/** The jobs of the service that this caller may see. */
export async function showJobs(client: Client, open: (job: Job) => void): Promise<void> {
  const dialog = await listJobs(client, 'Jobs', {}, (job) => {
    const remove = iconButton('close', `Delete ${nameOf(job)}`, async () => {
      await client.remove(job.id).then(() => row.remove(), (error: unknown) => row.append(refusal(error)));
    });
    const row = h('li', { class: 'row' }, jobButton(job, sizeAndDate(job), () => { dialog.close(); open(job); }), remove);
    return row;
  });
}

/** In what a job is another than `job`. */
function otherThan(job: Job, other: Job): string {
  if (other.input.sha256 !== job.input.sha256) return 'Another mesh';
  const before = job.parameters as Record<string, unknown>;
  const own = Object.entries(other.parameters).filter(([name, value]) => value !== before[name]).map(([name, value]) => `${parameterWords(name).toLowerCase()} ${String(value)}`);
  return own.length > 0 ? `The same mesh with ${own.join(', ')}` : 'The same mesh and parameters';
}

/** Lets someone choose one of the jobs that are done, to compare `job` with; with what is different in each. */
export function chooseOther(client: Client, job: Job): Promise<Job | undefined> {
  return new Promise((resolve, reject) => {
    let chosen: Job | undefined;
    const listed = listJobs(client, 'Compare with', { state: 'succeeded' }, (other) => {
      if (other.id === job.id) return undefined;
      return h('li', { class: 'row' }, jobButton(other, `${otherThan(job, other)}. ${sizeAndDate(other)}`, () => { chosen = other; void listed.then((dialog) => dialog.close()); }));
    }, (other) => other.input.sha256 === job.input.sha256);
    listed.then((dialog) => dialog.addEventListener('close', () => resolve(chosen)), reject);
  });
}

const kKeys: [string, string][] = [
  ['drag', 'turn'], ['shift + drag', 'move'], ['wheel or + −', 'come closer, go away'], ['arrow keys', 'turn; with shift, move'],
  ['space', 'flip between before and after'], ['d', 'divider'], ['f', 'everything in view'], ['w', 'wireframe'], ['r', 'ridges'],
  ['m', 'measure; enter takes the point in the middle of the view'], ['i', 'the numbers in the middle of the view'], ['o', 'open a file'], ['?', 'this list'],
];

export function showKeys(): void {
  openDialog('Keys', h('dl', { class: 'keys' }, ...kKeys.flatMap(([key, meaning]) => [h('dt', {}, h('kbd', {}, key)), h('dd', {}, meaning)])),
    h('p', { class: 'quiet-text' }, h('a', { href: 'docs' }, 'The API'), ' behind this page.'));
}
