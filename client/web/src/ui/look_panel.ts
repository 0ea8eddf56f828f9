import type { Surface } from '../mesh/surface';
import type { Stage } from '../viewer/stage';
import { fill, h } from './dom';
import { ColourPicker, type Measure } from './look';
import { count } from './words';

const kThreshold = 0.5;
type Direction = [number, number, number];
const kAxes: Record<string, Direction> = { x: [1, 0, 0], y: [0, 1, 0], z: [0, 0, 1] };
const kAsSeen = 'seen';

/** How the mesh is drawn: colours, ridges, wires, facets, a section. */
export class LookPanel {
  readonly element = h('div', { class: 'look' });
  private readonly colours: ColourPicker;
  private readonly threshold = h('input', { id: 'threshold', type: 'range', min: 0.02, max: 1, step: 0.01, value: kThreshold, oninput: () => this.drawRidges() });
  private readonly thresholdText = h('output', { for: 'threshold' });
  private readonly ridgesBox = h('input', { type: 'checkbox', checked: true, onchange: () => this.drawRidges() });
  private readonly wiresBox = h('input', { type: 'checkbox', onchange: () => this.setWires(this.wiresBox.checked) });
  private readonly facetsBox = h('input', { type: 'checkbox', onchange: () => this.setFacets() });
  private readonly axis = h('select', { id: 'section-axis', onchange: () => this.turnSection() },
    h('option', { value: '' }, 'none'), ...Object.keys(kAxes).map((name) => h('option', { value: name }, `across ${name}`)),
    h('option', { value: kAsSeen }, 'across the view'));
  private readonly otherSide = h('input', { type: 'checkbox', onchange: () => this.cut() });
  private direction?: Direction;
  private readonly position = h('input', { type: 'range', min: -1, max: 1, step: 0.005, value: 0, 'aria-label': 'Position of the section', oninput: () => this.cut() });

  private readonly cutting = h('div', { class: 'cutting', hidden: true });

  constructor(private readonly stage: Stage, private readonly wiresChanged: (on: boolean) => void) {
    const { after } = stage;
    this.colours = new ColourPicker(
      (colouring) => { after.setColouring(colouring); stage.redraw(); },
      (range) => { after.material.choose(range); stage.redraw(); });
    const box = (input: HTMLElement, words: string) => h('label', {}, input, words);
    fill(this.element, this.colours.element,
      h('div', { class: 'field' }, h('div', { class: 'row' }, h('label', { for: 'threshold' }, 'Ridges from label'), this.thresholdText), this.threshold,
        h('div', { class: 'ends' }, h('span', {}, 'unsure'), h('span', {}, 'certain'))),
      h('div', { class: 'switches' }, box(this.ridgesBox, 'Ridges'), box(this.wiresBox, 'Wireframe'), box(this.facetsBox, 'Flat facets')),
      h('div', { class: 'field' }, h('div', { class: 'row' }, h('label', { for: 'section-axis' }, 'Section'), this.axis), this.cutting));
    fill(this.cutting, this.position, box(this.otherSide, 'The other side'));
  }

  /** What a vertex has of what the mesh is coloured by, in words. */
  valueAt(vertex: number): string | undefined {
    return this.colours.valueAt(vertex);
  }

  /** Offers these colours for a result that has just come onto the stage. */
  offer(measures: Measure[], surface?: Surface): void {
    this.colours.offer(measures, surface);
    this.drawRidges();
    this.setWires(this.wiresBox.checked);
    this.setFacets();
    this.cut();
  }

  get wires(): boolean {
    return this.wiresBox.checked;
  }

  setWires(on: boolean): void {
    this.wiresBox.checked = on;
    for (const layer of [this.stage.before, this.stage.after]) layer.showWires(on);
    this.wiresChanged(on);
    this.stage.redraw();
  }

  toggleRidges(): void {
    this.ridgesBox.checked = !this.ridgesBox.checked;
    this.drawRidges();
  }

  private drawRidges(): void {
    const value = Number(this.threshold.value);
    const shown = this.stage.after.setThreshold(value);
    this.stage.after.showRidges(this.ridgesBox.checked);
    this.thresholdText.textContent = `${value.toFixed(2)}: ${count(shown, 'edge')}`;
    this.stage.redraw();
  }

  private setFacets(): void {
    for (const layer of [this.stage.before, this.stage.after]) layer.material.facets = this.facetsBox.checked;
    this.stage.redraw();
  }

  private turnSection(): void {
    const direction = this.axis.value === kAsSeen ? this.stage.orbit.towardsEye : kAxes[this.axis.value];
    if (direction) this.direction = direction;
    else delete this.direction;
    this.cut();
  }

  /** Cuts away one side of the section. */
  private cut(): void {
    const { direction, stage: { middle, size } } = this;
    this.cutting.hidden = !direction;
    const at = direction ? direction.reduce((sum, x, k) => sum + x * middle[k]!, 0) + Number(this.position.value) * size : 0;
    const side = this.otherSide.checked ? -1 : 1;
    const [x, y, z] = direction ?? [0, 0, 0];
    for (const layer of [this.stage.before, this.stage.after]) layer.setSection(direction ? [side * x, side * y, side * z, -side * at] : [0, 0, 0, -1]);
    this.stage.redrawMoving();
  }
}
