import type { Parameters } from 'creased-client';
import { fill, h, iconButton } from './dom';

const kOutput = 'smooth.ply';

function quoted(text: string): string {
  return /^[\w./:=@%-]+$/.test(text) ? text : `'${text.replaceAll("'", `'\\''`)}'`;
}

function curlCommand(service: string, name: string, parameters: Parameters, keyed: boolean): string {
  const given = JSON.stringify(parameters);
  const lines = ['curl -s'];
  if (keyed) lines.push('-H "Authorization: Bearer $CREASED_KEY"');
  lines.push(`-H 'Prefer: wait=60'`, `-F mesh=@${quoted(name)}`);
  if (given !== '{}') lines.push(`-F ${quoted(`parameters=${given}`)}`);
  lines.push(quoted(`${service}v1/jobs`));
  return lines.join(' \\\n  ');
}

function creaseCommand(service: string, name: string, parameters: Parameters): string {
  const given = Object.entries(parameters).map(([key, value]) => `-p ${quoted(`${key}=${String(value)}`)}`);
  return ['crease smooth', quoted(name), `-o ${kOutput}`, '--labels labels.json', ...given, `--server ${quoted(service.replace(/\/$/, ''))}`].join(' \\\n  ');
}

/** The job of the page as commands to copy, in step with it. */
export class Commands {
  readonly element = h('div', { class: 'commands' });
  private readonly code = h('code');
  private readonly tabs: HTMLButtonElement[];
  private texts: [string, string] = ['', ''];
  private shown = 0;

  constructor() {
    this.tabs = ['curl', 'crease'].map((name, k) =>
      h('button', { type: 'button', role: 'tab', 'aria-selected': k === 0, 'aria-controls': 'command-text', onclick: () => this.show(k) }, name));
    const copy = iconButton('copy', 'Copy the command', async () => {
      await navigator.clipboard.writeText(this.texts[this.shown]!);
      copy.classList.add('done');
      setTimeout(() => copy.classList.remove('done'), 1200);
    });
    fill(this.element,
      h('div', { class: 'row' }, h('div', { role: 'tablist', 'aria-label': 'Command', class: 'tabs' }, ...this.tabs), copy),
      h('pre', { id: 'command-text', role: 'tabpanel', tabindex: 0, 'aria-label': 'Command' }, this.code));
  }

  update(name: string, parameters: Parameters, keyed: boolean): void {
    const service = new URL('.', document.baseURI).href;
    this.texts = [curlCommand(service, name, parameters, keyed), creaseCommand(service, name, parameters)];
    this.show(this.shown);
  }

  private show(which: number): void {
    this.shown = which;
    this.tabs.forEach((tab, k) => tab.setAttribute('aria-selected', String(k === which)));
    this.code.textContent = this.texts[which]!;
  }
}
