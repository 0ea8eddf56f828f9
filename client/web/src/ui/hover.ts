import type { EdgeLabels } from 'creased-client';
import type { Outcome } from '../session';
import type { Stage } from '../viewer/stage';
import { fill, h } from './dom';
import { number } from './words';

const kTapPixels = 8;
const kClasses = ['on a smooth part', 'on a ridge', 'a corner'];

/** Says what is under the pointer when it rests there. */
export class Hover {
  readonly element = h('div', { class: 'card hover', role: 'status', hidden: true });
  private timer = 0;
  private pressed = { x: 0, y: 0 };
  private readonly known = new WeakMap<EdgeLabels, Map<string, number>>();

  /** `valueAt` says what a vertex has of what the mesh is coloured by. */
  constructor(
    private readonly stage: Stage,
    private readonly outcome: () => Outcome | undefined,
    private readonly valueAt: (vertex: number) => string | undefined,
  ) {
    const { canvas } = stage;
    canvas.addEventListener('pointermove', (event) => {
      this.hide();
      if (event.pointerType === 'mouse' && !stage.orbit.dragging) {
        this.timer = window.setTimeout(() => this.show(event.offsetX, event.offsetY), 140);
      }
    });
    canvas.addEventListener('pointerleave', () => this.hide());
    canvas.addEventListener('pointerdown', (event) => {
      this.hide();
      this.pressed = { x: event.offsetX, y: event.offsetY };
    });
    canvas.addEventListener('pointerup', (event) => {
      const { x, y } = this.pressed;
      if (event.pointerType !== 'mouse' && Math.hypot(event.offsetX - x, event.offsetY - y) < kTapPixels) this.show(event.offsetX, event.offsetY);
    });
  }

  /** Says what is in the middle of the view, for those who work with keys. */
  atMiddle(): void {
    this.show(this.stage.canvas.clientWidth / 2, this.stage.canvas.clientHeight / 2);
  }

  hide(): void {
    clearTimeout(this.timer);
    this.element.hidden = true;
  }

  private show(x: number, y: number): void {
    const hit = this.stage.pick(x, y);
    if (!hit) return;
    const surface = this.stage[hit.which].surface!;
    const source = (v: number) => surface.source?.[v] ?? v;
    const lines = [`face ${hit.face}, vertex ${source(hit.vertex)}`];
    const kind = hit.which === 'after' ? surface.vertexClass?.[hit.vertex] : undefined;
    if (kind !== undefined) lines.push(`vertex ${kClasses[kind] ?? ''}, segment ${surface.segment?.[hit.vertex] ?? '–'}`);
    const value = hit.which === 'after' ? this.valueAt(hit.vertex) : undefined;
    if (value) lines.push(value);
    const labels = this.outcome()?.labels;
    if (labels && hit.which === 'after') {
      const [a, b] = hit.edge.map(source) as [number, number];
      const edge = this.edges(labels).get(key(a, b));
      lines.push(edge === undefined
        ? `edge ${a} to ${b}: no ridge`
        : `edge ${a} to ${b}: label ${labels.labels[edge]!.toFixed(3)}, angle ${number(labels.dihedralDeg[edge]!, 3)}°`);
    }
    lines.push(hit.point.map((p, k) => number(p + surface.origin[k]!, 5)).join(', '));
    fill(this.element, lines.join('\n'));
    this.element.hidden = false;
    const { clientWidth, clientHeight } = this.stage.canvas;
    this.element.style.left = `${Math.min(x + 16, clientWidth - this.element.offsetWidth - 8)}px`;
    this.element.style.top = `${Math.min(y + 16, clientHeight - this.element.offsetHeight - 8)}px`;
  }

  private edges(labels: EdgeLabels): Map<string, number> {
    let map = this.known.get(labels);
    if (!map) {
      map = new Map();
      for (let e = 0; e < labels.labels.length; ++e) map.set(key(labels.edges[2 * e]!, labels.edges[2 * e + 1]!), e);
      this.known.set(labels, map);
    }
    return map;
  }
}

const key = (a: number, b: number): string => (a < b ? `${a} ${b}` : `${b} ${a}`);
