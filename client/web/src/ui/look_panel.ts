import type { Surface } from '../mesh/surface';
import type { Stage } from '../viewer/stage';
import { fill, h } from './dom';
import { ColourPicker, type Measure } from './look';
import { count } from './words';

const kThreshold = 0.5;
const kDirections: Record<string, [number, number, number]> = { x: [1, 0, 0], y: [0, 1, 0], z: [0, 0, 1] };

/** How the mesh is drawn: colours, ridges, wires, facets, a section. */
export class LookPanel {
  readonly element = h('div', { class: 'look' });
  private readonly colours: ColourPicker;
  private readonly threshold = h('input', { id: 'threshold', type: 'range', min: 0.02, max: 1, step: 0.01, value: kThreshold, oninput: () => this.drawRidges() });
  private readonly thresholdText = h('output', { for: 'threshold' });
  private readonly ridgesBox = h('input', { type: 'checkbox', checked: true, onchange: () => this.drawRidges() });
  private readonly wiresBox = h('input', { type: 'checkbox', onchange: () => this.setWires(this.wiresBox.checked) });
  private readonly facetsBox = h('input', { type: 'checkbox', onchange: () => this.setFacets() });
  private readonly axis = h('select', { id: 'section-axis', onchange: () => this.cut() },
    h('option', { value: '' }, 'none'), ...Object.keys(kDirections).map((name) => h('option', { value: name }, `across ${name}`)));
  private readonly position = h('input', { type: 'range', min: -1, max: 1, step: 0.005, value: 0, 'aria-label': 'Position of the section', hidden: true, oninput: () => this.cut() });

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
      h('div', { class: 'field' }, h('div', { class: 'row' }, h('label', { for: 'section-axis' }, 'Section'), this.axis), this.position));
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

  private cut(): void {
    const direction = kDirections[this.axis.value];
    this.position.hidden = !direction;
    const { middle, size } = this.stage;
    const at = direction ? direction.reduce((sum, x, k) => sum + x * middle[k]!, 0) + Number(this.position.value) * size : 0;
    for (const layer of [this.stage.before, this.stage.after]) layer.setSection(direction ? [...direction, -at] : [0, 0, 0, -1]);
    this.stage.redraw();
  }
}
