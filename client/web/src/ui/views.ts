import type { Arrangement, Stage } from '../viewer/stage';
import { fill, h, iconButton, svg } from './dom';
import { number } from './words';

const kNames: [Arrangement, string][] = [['before', 'Before'], ['divided', 'Divide'], ['after', 'After'], ['beside', 'Compare']];

/** What lies over the canvas: the choice of view, the divider, and tools. */
export class Views {
  readonly element = h('div', { class: 'over' });
  private readonly choice = h('div', { class: 'views', role: 'group', 'aria-label': 'View', hidden: true });
  private readonly divider: HTMLButtonElement;
  private readonly captions = h('div', { class: 'captions', hidden: true }, h('span', {}, 'first job'), h('span', {}, 'second job'));
  private readonly gear = h('div', { class: 'gear', role: 'toolbar', 'aria-label': 'Tools', hidden: true });
  private two = false;
  readonly wire: HTMLButtonElement;
  readonly ruler: HTMLButtonElement;

  constructor(
    private readonly stage: Stage,
    private readonly tools: { wire: (on: boolean) => void; measure: (on: boolean) => void; picture: () => void; arranged: (name: Arrangement) => void; compare: () => void },
  ) {
    fill(this.choice, ...kNames.map(([name, words]) => h('button', { type: 'button', 'data-view': name, 'aria-pressed': false, onclick: () => this.show(name) }, words)));
    this.divider = h('button', { type: 'button', class: 'divider', role: 'slider', 'aria-label': 'Divider between before and after', 'aria-valuemin': 0, 'aria-valuemax': 100, 'aria-orientation': 'horizontal', hidden: true },
      h('span', { class: 'side left' }, 'before'), h('span', { class: 'grip' }, svg('svg', { viewBox: '0 0 24 24', width: 20, height: 20, class: 'icon', 'aria-hidden': 'true' }, svg('path', { d: 'M9 7l-5 5 5 5M15 7l5 5-5 5' })) as unknown as Node), h('span', { class: 'side right' }, 'after'));
    this.dragDivider();
    this.wire = this.toggle('wire', 'Wireframe', this.tools.wire);
    this.ruler = this.toggle('ruler', 'Measure between two points', this.tools.measure);
    fill(this.gear, iconButton('frame', 'Everything in view', () => stage.reframe()), this.wire, this.ruler, iconButton('camera', 'Save a picture', this.tools.picture));
    fill(this.element, this.choice, this.divider, this.captions, this.gear);
  }

  /** Offers the tools once there is a mesh, the views once there is a result, to compare once there are two. */
  offer(mesh: boolean, result: boolean, two = false): void {
    this.gear.hidden = !mesh;
    this.choice.hidden = !result;
    this.two = two;
    this.refresh();
  }

  /** Shows a view; the one of two jobs, where there is only one yet, after the other has been chosen. */
  show(name: Arrangement): void {
    if (name === 'beside' && !this.two) return this.tools.compare();
    this.tools.arranged(name);
    this.stage.arrangement = name;
    this.refresh();
  }

  /** From the result to the measured mesh and back. */
  flip(): void {
    this.show(this.stage.arrangement === 'before' ? 'after' : 'before');
  }

  get ready(): boolean {
    return !this.choice.hidden;
  }

  refresh(): void {
    const { arrangement, divider } = this.stage;
    for (const button of this.choice.children) button.setAttribute('aria-pressed', String(button.getAttribute('data-view') === arrangement));
    this.divider.hidden = arrangement !== 'divided' || this.choice.hidden;
    this.captions.hidden = arrangement !== 'beside';
    this.divider.style.left = `${100 * divider}%`;
    this.divider.setAttribute('aria-valuenow', String(Math.round(100 * divider)));
    this.divider.setAttribute('aria-valuetext', `${Math.round(100 * divider)} percent before`);
  }

  private toggle(name: string, words: string, change: (on: boolean) => void): HTMLButtonElement {
    const button = iconButton(name, words, () => {
      const on = button.getAttribute('aria-pressed') !== 'true';
      button.setAttribute('aria-pressed', String(on));
      change(on);
    });
    button.setAttribute('aria-pressed', 'false');
    return button;
  }

  private dragDivider(): void {
    const { divider, stage } = this;
    divider.addEventListener('pointerdown', (event) => {
      divider.setPointerCapture(event.pointerId);
      stage.held = true;
    });
    divider.addEventListener('lostpointercapture', () => (stage.held = false));
    divider.addEventListener('pointermove', (event) => {
      if (!divider.hasPointerCapture(event.pointerId)) return;
      const box = stage.canvas.getBoundingClientRect();
      stage.divider = (event.clientX - box.left) / box.width;
      this.refresh();
    });
    divider.addEventListener('keydown', (event) => {
      const step = { ArrowLeft: -0.02, ArrowRight: 0.02, Home: -1, End: 1 }[event.key];
      if (step === undefined) return;
      event.preventDefault();
      stage.divider = stage.divider + step;
      this.refresh();
    });
  }
}

interface End {
  point: [number, number, number];
  which: 'before' | 'after';
}

/** Measures the straight distance between two points of a mesh. */
export class Ruler {
  readonly element = h('div', { class: 'ruler', hidden: true });
  private readonly drawing = svg('svg', { class: 'measure-line', 'aria-hidden': 'true' });
  private readonly text = h('div', { class: 'measure-text', role: 'status' });
  private ends: End[] = [];
  on = false;

  constructor(private readonly stage: Stage, private readonly edgeLength: () => number) {
    this.element.append(this.drawing, this.text);
  }

  toggle(on: boolean): void {
    this.on = on;
    this.ends = [];
    this.stage.canvas.style.cursor = on ? 'crosshair' : '';
    this.element.hidden = !on;
    this.draw();
  }

  /** Takes the point of the mesh that is at a point of the canvas, where there is one. */
  addAt(x: number, y: number): void {
    const end = this.stage.pick(x, y);
    if (end) this.add(end);
  }

  private add(end: End): void {
    if (this.ends.length === 2 || (this.ends[0] && this.ends[0].which !== end.which)) this.ends = [];
    this.ends.push(end);
    this.draw();
  }

  draw(): void {
    if (!this.on) return;
    const at = this.ends.map((end) => this.stage.project(end.point, end.which));
    const circles = at.map(({ x, y }) => svg('circle', { cx: x, cy: y, r: 5 }));
    const keys = this.stage.canvas.matches(':focus-visible');
    const [a, b] = at;
    this.drawing.replaceChildren(...(a && b ? [svg('line', { x1: a.x, y1: a.y, x2: b.x, y2: b.y })] : []), ...circles, ...(keys ? [this.cross()] : []));
    if (a && b) {
      const length = Math.hypot(...this.ends[0]!.point.map((x, k) => x - this.ends[1]!.point[k]!));
      const edges = this.edgeLength();
      this.text.textContent = `${number(length, 4)} units${edges > 0 ? `, ${number(length / edges, 3)} edges` : ''}`;
      this.place((a.x + b.x) / 2, (a.y + b.y) / 2);
    } else {
      const way = keys ? 'Turn a point of the mesh to the cross and press Enter' : 'Click a point of the mesh';
      this.text.textContent = this.ends.length === 0 ? `${way}, then another.` : `${way}: the second one.`;
      this.place(a?.x ?? this.stage.canvas.clientWidth / 2, a?.y ?? 96);
    }
  }

  /** Where Enter takes a point. */
  private cross(): SVGElement {
    const { clientWidth, clientHeight } = this.stage.canvas;
    const x = clientWidth / 2, y = clientHeight / 2;
    return svg('path', { d: `M${x - 9} ${y}h18M${x} ${y - 9}v18` });
  }

  private place(x: number, y: number): void {
    this.text.style.left = `${x}px`;
    this.text.style.top = `${y}px`;
  }
}

/** Says what went wrong, over the canvas, until it is closed. */
export class Notice {
  readonly element = h('section', { class: 'card notice', role: 'alert', hidden: true });

  show(title: string, text: string): void {
    fill(this.element, h('div', { class: 'grow' }, h('h2', {}, title), h('p', {}, text)), iconButton('close', 'Close', () => this.hide()));
    this.element.hidden = false;
  }

  hide(): void {
    this.element.hidden = true;
  }
}

