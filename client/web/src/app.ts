import { CreasedError, type Job } from 'creased-client';
import { clientWith, storedKey, withKey } from './access';
import { addressOf, hashOf, linksOf, placeOf } from './address';
import { measuresOf } from './mesh/measures';
import { readInWorker } from './mesh/reader';
import type { Surface } from './mesh/surface';
import { loadOutcome, sameMesh, type Outcome } from './session';
import { Snapshots } from './snapshots';
import { listenForMeshes, type Upload } from './ui/arrivals';
import { downloadsOf, quickDownload, save } from './ui/away';
import { Commands } from './ui/commands';
import { askForText, chooseOther, showJobs, showKeys } from './ui/dialogs';
import { fill, h, iconButton, section, unfold } from './ui/dom';
import { Hover } from './ui/hover';
import { LookPanel } from './ui/look_panel';
import { ParameterForm, type Schema, type Value } from './ui/parameters';
import { factsOf, figuresOf, RidgeList } from './ui/result';
import { RunCard } from './ui/run';
import { canvasColours, toggleTheme } from './ui/theme';
import { Notice, Ruler, Views } from './ui/views';
import { recent, welcome } from './ui/welcome';
import { errorWords, stateWord } from './ui/words';
import { sortedRidges } from './viewer/layer';
import { Stage, type Arrangement } from './viewer/stage';

const kRidgeThreshold = 0.5;
const kRecentJobs = 3;

/** The page: one mesh, its jobs, and what they made of it. */
export class Workbench {
  private client = clientWith([]);
  private readonly holder = document.getElementById('stage')!;
  private readonly panel = document.getElementById('panel')!;
  private readonly now = document.getElementById('now')!;
  private readonly canvas = h('canvas', { tabindex: 0, role: 'img', 'aria-label': 'The mesh. Arrow keys turn it, plus and minus zoom.', 'aria-keyshortcuts': 'Space D F W R M I' });
  private readonly stage: Stage;
  private readonly views: Views;
  private readonly look: LookPanel;
  private readonly ruler: Ruler;
  private readonly hover: Hover;
  private readonly notice = new Notice();
  private readonly run = new RunCard(() => this.cancel());
  private readonly commands = new Commands();
  private readonly ridges = new RidgeList((vertices, closed) => {
    this.stage.after.light(vertices, closed);
    this.stage.redraw();
  });
  private readonly file = listenForMeshes(this.holder, (upload) => void this.open(upload));
  private readonly parts: Record<'facts' | 'result' | 'away', HTMLElement> = { facts: h('div'), result: h('div'), away: h('div') };
  private parameters?: ParameterForm;
  private upload?: Upload;
  private job?: Job;
  private outcome?: Outcome;
  private compared?: Outcome;
  private following = new AbortController();

  constructor() {
    this.holder.append(this.canvas);
    this.stage = new Stage(this.canvas);
    this.views = new Views(this.stage, {
      wire: (on) => this.look.setWires(on),
      measure: (on) => this.ruler.toggle(on),
      picture: () => void this.savePicture(),
      arranged: (name) => this.arrange(name),
      compare: () => void this.compare(),
    });
    this.look = new LookPanel(this.stage, (on) => this.views.wire.setAttribute('aria-pressed', String(on)));
    this.ruler = new Ruler(this.stage, () => this.job?.input.mean_edge_length ?? 0);
    this.hover = new Hover(this.stage, () => this.outcome, (vertex) => this.look.valueAt(vertex));
    this.stage.onDraw = () => this.ruler.draw();
    this.holder.append(this.views.element, this.ruler.element, this.hover.element, this.run.element, this.notice.element, this.file);
  }

  async start(): Promise<void> {
    this.listen();
    this.theme();
    fill(document.getElementById('tools')!,
      iconButton('open', 'Open a mesh', () => this.file.click()),
      iconButton('jobs', 'Jobs', () => void this.attempt(() => showJobs(this.client, (job) => this.goTo(job)))),
      iconButton('sun', 'Light or dark', () => { toggleTheme(); this.theme(); }),
      iconButton('help', 'Keys and help', showKeys));
    await this.route();
    // Who was sent a link may have no key, and need none.
    if (placeOf(location.hash)?.share && !storedKey()) return;
    await this.attempt(() => this.loadParameters());
    await this.offerRecent();
  }

  private goTo(job: Job): void {
    location.hash = hashOf({ job: job.id });
  }

  /** At the start: the jobs of before, for someone who comes back without their address. */
  private async offerRecent(): Promise<void> {
    const start = document.getElementById('welcome');
    if (!start || !this.parameters) return;
    const { jobs } = await this.client.jobs({ limit: kRecentJobs });
    start.append(recent(jobs, (job) => this.goTo(job)));
  }

  private listen(): void {
    window.addEventListener('hashchange', () => void this.route());
    window.addEventListener('keydown', (event) => this.shortcut(event));
    window.addEventListener('error', ({ message }) => this.notice.show('Something went wrong on this page', message));
    window.addEventListener('unhandledrejection', (event) => {
      if (!(event.reason instanceof CreasedError)) return;
      event.preventDefault();
      this.fail(event.reason);
    });
    matchMedia('(prefers-color-scheme: dark)').addEventListener('change', () => this.theme());
    this.canvas.addEventListener('click', (event) => {
      if (!this.ruler.on) return;
      this.ruler.addAt(event.offsetX, event.offsetY);
    });
  }

  private shortcut(event: KeyboardEvent): void {
    const target = event.target as HTMLElement;
    if (event.ctrlKey || event.metaKey || event.altKey || target.matches('input, select, textarea, summary') || document.querySelector('dialog[open]')) return;
    const keys: Record<string, () => void> = {
      d: () => this.views.ready && this.views.show('divided'),
      f: () => this.stage.reframe(),
      w: () => this.look.setWires(!this.look.wires),
      r: () => this.look.toggleRidges(),
      m: () => this.views.ruler.click(),
      i: () => this.hover.atMiddle(),
      Enter: () => target === this.canvas && this.ruler.on && this.ruler.addAt(this.canvas.clientWidth / 2, this.canvas.clientHeight / 2),
      o: () => this.file.click(),
      '?': showKeys,
    };
    if (event.key === ' ' && target.tagName !== 'BUTTON' && this.views.ready) {
      event.preventDefault();
      this.views.flip();
    } else keys[event.key]?.();
  }

  private theme(): void {
    const { clay, inside, wire } = canvasColours();
    for (const layer of [this.stage.before, this.stage.after]) layer.setTheme(clay, inside, wire);
    this.stage.redraw();
  }

  /** Shows the job that the address names, or the start. */
  private async route(): Promise<void> {
    const place = placeOf(location.hash);
    if (!place) return this.goToStart();
    if (place.job === this.job?.id && place.with === this.compared?.job.id) return;
    this.client = clientWith(linksOf(place));
    await this.attempt(async () => this.reopen(await this.client.job(place.job), place.with));
  }

  private async goToStart(): Promise<void> {
    this.leave();
    for (const one of ['upload', 'job', 'compared'] as const) delete this[one];
    this.stage.clear();
    this.views.offer(false, false);
    fill(this.now);
    document.title = 'creased';
    this.drawPanel();
    this.showWelcome();
    await this.attempt(() => this.offerRecent());
  }

  private showWelcome(): void {
    this.leaveWelcome();
    this.holder.classList.add('empty');
    this.panel.classList.add('empty');
    this.canvas.tabIndex = -1;
    this.holder.append(welcome({
      choose: () => this.file.click(),
      paste: () => void askForText().then((text) => (text ? this.open({ bytes: new Blob([text]), name: 'pasted' }) : undefined)),
      sample: (name) => void this.attempt(async () => this.open({ bytes: new Blob([await this.client.sample(name)]), name })),
    }));
  }

  private leaveWelcome(): void {
    document.getElementById('welcome')?.remove();
    this.holder.classList.remove('empty');
    this.canvas.tabIndex = 0;
  }

  private async loadParameters(): Promise<void> {
    const schema = (await this.client.parameters()) as Schema;
    this.parameters = new ParameterForm(schema, () => this.updateCommands());
    this.drawPanel();
  }

  /** Shows a new mesh and smooths it with the present parameters, the automatic ones at first. */
  private async open(upload: Upload): Promise<void> {
    this.leave();
    this.upload = upload;
    delete this.job;
    delete this.compared;
    this.drawPanel();
    this.leaveWelcome();
    this.stage.clear();
    this.views.offer(false, false);
    this.say(upload.name, 'reading');
    const shown = upload.bytes.arrayBuffer()
      .then((bytes) => readInWorker(bytes, upload.name, false))
      .then((surface) => {
        const refused = document.getElementById('welcome') !== null;
        if (this.upload !== upload || this.outcome || refused) return;
        this.stage.open(surface);
        this.views.offer(true, false);
      })
      .catch(() => undefined);
    await Promise.all([shown, this.submit()]);
  }

  private async submit(): Promise<void> {
    const { upload } = this;
    if (!upload) return;
    this.leave();
    const { signal } = this.following;
    this.run.begin('Uploading');
    await this.attempt(async () => {
      const job = await this.client.submit(upload.bytes, {
        name: upload.name,
        parameters: this.parameters?.parameters ?? {},
        onProgress: (sent, total) => this.run.uploading(sent, total),
        signal,
      });
      history.pushState(null, '', hashOf({ job: job.id, ...(this.compared ? { with: this.compared.job.id } : {}) }));
      await this.follow(job, signal);
    });
    if (!signal.aborted) this.run.end();
  }

  private async reopen(job: Job, other?: string): Promise<void> {
    this.leave();
    this.leaveWelcome();
    delete this.upload;
    delete this.compared;
    this.stage.clear();
    this.views.offer(false, false);
    this.run.begin(job.state === 'succeeded' ? 'Loading the result' : 'Finding the job');
    const { signal } = this.following;
    await this.attempt(async () => {
      if (other) this.compared = await loadOutcome(this.client, await this.client.job(other), signal);
      await this.follow(job, signal);
    });
    if (!signal.aborted) this.run.end();
  }

  /** Stays with a job until it has ended, and shows what it made. */
  private async follow(job: Job, signal: AbortSignal): Promise<void> {
    this.setJob(job);
    if (job.state === 'queued' || job.state === 'running') {
      const snapshots = new Snapshots(this.client, job.id, signal, (surface) => this.showSnapshot(surface));
      for await (const event of this.client.follow(job.id, { signal })) {
        if (event.type === 'progress') {
          this.run.update(event.progress);
          if (event.progress.stage !== 'queued') this.say(job.input.name || job.id, 'running');
        } else if (event.type === 'lost') this.run.lost();
        else job = event.job;
      }
      snapshots.stop();
    }
    this.setJob(job);
    if (job.state === 'succeeded') {
      this.run.loading();
      await this.showOutcome(await loadOutcome(this.client, job, signal));
    }
    if (job.state === 'failed') this.notice.show('The job failed', job.error?.detail || job.error?.title || '');
    if (job.state === 'cancelled') this.notice.show('Cancelled', 'The job was stopped. Change the parameters and smooth again, or open another mesh.');
    this.drawPanel();
  }

  private showSnapshot(surface: Surface): void {
    const { stage } = this;
    this.run.ridges((surface.ridges?.length ?? 0) / 2);
    if (!stage.before.surface && !stage.after.surface) stage.open(surface, 'after');
    else {
      stage.show('after', surface);
      stage.lookAgain(surface);
      this.views.show('after');
    }
    if (surface.ridges) {
      stage.after.setRidges(sortedRidges(surface.ridges, new Float32Array(surface.ridges.length / 2).fill(0.9)));
      stage.after.setThreshold(kRidgeThreshold);
    }
    this.views.offer(true, false);
  }

  private async showOutcome(outcome: Outcome): Promise<void> {
    const fresh = this.stage.before.surface === undefined && this.stage.after.surface === undefined;
    this.outcome = outcome;
    const { stage } = this;
    if (fresh) stage.open(outcome.measured ?? outcome.surface, 'before');
    else if (outcome.measured) {
      stage.show('before', outcome.measured);
      stage.lookAgain(outcome.measured);
    }
    stage.show('after', outcome.surface);
    stage.after.setRidges(sortedRidges(outcome.labels.edges, outcome.labels.labels));
    this.look.offer(measuresOf({
      edgeLength: outcome.job.input.mean_edge_length,
      labels: outcome.labels,
      ...(outcome.measured ? { measured: outcome.measured } : {}),
      ...(this.compared ? { other: sameMesh(this.compared, outcome) ? this.compared.surface : undefined } : {}),
      ...(this.parameters?.allows('uncertainty') ? { askForUncertainty: () => this.againWith('uncertainty', true) } : {}),
    }), outcome.surface);
    this.views.offer(true, true, this.compared !== undefined);
    this.views.show(this.compared ? 'beside' : 'divided');
    this.theme();
  }

  /** Lets someone choose a job of before, and puts it beside the one that is shown. */
  private async compare(): Promise<void> {
    const { outcome } = this;
    if (!outcome) return;
    const { signal } = this.following;
    await this.attempt(async () => {
      const other = await chooseOther(this.client, outcome.job);
      if (!other) return;
      this.compared = await loadOutcome(this.client, other, signal);
      if (this.outcome !== outcome) return;
      history.pushState(null, '', hashOf({ job: outcome.job.id, with: other.id }));
      await this.showOutcome(outcome);
      this.drawPanel();
    });
  }

  /** Puts on the left what a view has there: the result before, to compare with, or the measured mesh. */
  private arrange(name: Arrangement): void {
    const { compared, outcome, stage } = this;
    const left = name === 'beside' ? compared?.surface : outcome?.measured;
    if (!left || stage.before.surface === left) return;
    stage.show('before', left);
    if (name === 'beside' && compared) {
      stage.before.setRidges(sortedRidges(compared.labels.edges, compared.labels.labels));
      stage.before.setThreshold(kRidgeThreshold);
    }
  }

  private setJob(job: Job): void {
    this.job = job;
    this.say(job.input.name || job.id, stateWord(job));
    this.drawPanel();
  }

  private say(name: string, state: string): void {
    fill(this.now, h('h1', {}, name), h('span', {}, state));
    document.title = `${name} · creased`;
  }

  private drawPanel(): void {
    const { job, outcome } = this;
    this.panel.classList.toggle('empty', !job && !this.upload);
    const done = job?.state === 'succeeded' && outcome !== undefined;
    this.updateCommands();
    if (job) fill(this.parts.facts, factsOf(job));
    fill(this.parts.result, done && quickDownload(this.client, job, (error) => this.fail(error), () => unfold('away')), done && figuresOf(job, this.compared?.job),
      done && h('button', { type: 'button', class: 'text-button', onclick: () => void this.compare() }, this.compared ? 'Compare with another job' : 'Compare with an earlier job'));
    fill(this.parts.away, done && downloadsOf(this.client, job, {
      picture: () => this.savePicture(),
      link: () => addressOf(this.client, job.id),
      failed: (error) => this.fail(error),
    }));
    this.ridges.show(outcome?.ridges);
    // Sections are made once, so that what someone has unfolded stays so.
    const parts = [!!job, done, !!this.parameters].join();
    if (this.panel.dataset['parts'] === parts) return;
    this.panel.dataset['parts'] = parts;
    const again = h('button', { type: 'button', class: 'button primary', onclick: () => void this.again() }, 'Smooth again');
    fill(this.panel,
      job && section('facts', 'Your mesh', true, this.parts.facts),
      done && section('result', 'Result', true, this.parts.result),
      done && section('look', 'Look', true, this.look.element),
      done && section('ridges', 'Ridges', false, this.ridges.element),
      this.parameters && section('parameters', 'Parameters', !done, this.parameters.element, h('div', { class: 'submit' }, again)),
      section('commands', 'The same as a command', false, this.commands.element),
      done && section('away', 'Take it away', false, this.parts.away));
  }

  /** Another job with the same mesh. A job that was reopened has its mesh on the service only. */
  private async again(): Promise<void> {
    const { job, outcome } = this;
    if (outcome) this.compared = outcome;
    // A job that is not wanted any more does not keep the next one waiting.
    if (this.upload && job && (job.state === 'queued' || job.state === 'running')) await this.attempt(() => this.client.cancel(job.id));
    if (!this.upload && job) {
      await this.attempt(async () => {
        const bytes = await this.client.mesh(job.id, { format: 'original', measured: true });
        this.upload = { bytes: new Blob([bytes]), name: job.input.name };
      });
    }
    await this.submit();
  }

  private againWith(name: string, value: Value): void {
    this.parameters?.change(name, value);
    void this.again();
  }

  private async cancel(): Promise<void> {
    const { job, upload } = this;
    if (job && (job.state === 'queued' || job.state === 'running')) {
      await this.attempt(() => this.client.cancel(job.id));
      return;
    }
    // The next job is still on its way to the service.
    if (job) return this.reopen(job);
    this.leave();
    if (upload) this.say(upload.name, 'not sent');
  }

  /** Stops following what was followed. */
  private leave(): void {
    this.following.abort();
    this.following = new AbortController();
    this.notice.hide();
    this.run.end();
    delete this.outcome;
  }

  private updateCommands(): void {
    const name = this.upload?.name ?? this.job?.input.name ?? 'mesh.obj';
    this.commands.update(name, this.parameters?.parameters ?? {}, storedKey() !== undefined);
  }

  private async savePicture(): Promise<void> {
    const name = (this.job?.input.name ?? 'mesh').replace(/\.[^.]+$/, '');
    save(new File([await this.stage.picture(canvasColours().background)], `${name}.png`));
  }

  /** Does something with the service, and says what went wrong. */
  private attempt<T>(work: () => Promise<T>): Promise<T | undefined> {
    return withKey(work).catch((error: unknown) => {
      this.fail(error);
      return undefined;
    });
  }

  private fail(error: unknown): void {
    if (error instanceof DOMException && error.name === 'AbortError') return;
    if (!(error instanceof CreasedError)) {
      this.notice.show('Something went wrong on this page', String(error));
      throw error;
    }
    const words = errorWords(error);
    const { field } = error.problem ?? {};
    if (field && this.parameters?.refuse(field, words)) unfold('parameters');
    this.notice.show(error.problem?.title ?? 'No answer', words);
    if (this.upload && !this.job) this.say(this.upload.name, error.problem ? 'refused' : 'not sent');
    if (!this.job && !this.stage.before.surface) this.showWelcome();
  }
}
