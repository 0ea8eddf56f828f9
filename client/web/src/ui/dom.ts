type Child = Node | string | number | false | null | undefined;
type Attributes = Record<string, unknown>;

/** Makes an element. A function is a listener, `true` an attribute without a value; false and undefined leave it out. */
export function h<K extends keyof HTMLElementTagNameMap>(tag: K, attributes: Attributes = {}, ...children: Child[]): HTMLElementTagNameMap[K] {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (value === undefined || value === false || value === null) continue;
    if (typeof value === 'function') element.addEventListener(name.replace(/^on/, ''), value as EventListener);
    else element.setAttribute(name, value === true ? '' : String(value));
  }
  fill(element, ...children);
  return element;
}

/** Puts these children in place of what an element has. */
export function fill(element: Element, ...children: Child[]): void {
  element.replaceChildren(...children.filter((one): one is Node | string | number => one !== false && one != null).map((one) => (one instanceof Node ? one : String(one))));
}

const kSvg = 'http://www.w3.org/2000/svg';

/** Makes an element of a drawing. */
export function svg(tag: string, attributes: Record<string, string | number> = {}, ...children: Node[]): SVGElement {
  const element = document.createElementNS(kSvg, tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, String(value));
  element.append(...children);
  return element;
}

const kIcons: Record<string, string> = {
  open: 'M4 19V6h6l2 2h8v11z',
  paste: 'M8 5h8v3H8zM6 6H5v14h14V6h-1',
  jobs: 'M5 7h14M5 12h14M5 17h9',
  key: 'M14 10a4 4 0 1 0-2 3l2 2h2v2h2v2h3v-3l-6-6z',
  sun: 'M12 8a4 4 0 1 1 0 8 4 4 0 0 1 0-8zM12 3v2M12 19v2M3 12h2M19 12h2M5.6 5.6 7 7M17 17l1.4 1.4M5.6 18.4 7 17M17 7l1.4-1.4',
  help: 'M9 9a3 3 0 1 1 4 3c-1 .5-1 1-1 2M12 18v.5',
  camera: 'M4 8h4l1.5-2h5L16 8h4v11H4zM12 10.5a3 3 0 1 1 0 6 3 3 0 0 1 0-6z',
  frame: 'M4 9V4h5M15 4h5v5M20 15v5h-5M9 20H4v-5',
  ruler: 'M4 15 15 4l5 5L9 20zM8 11l2 2M11 8l2 2M14 5l2 2',
  wire: 'M12 4 4 18h16zM8 11h8M12 18l-4-7M12 18l4-7',
  copy: 'M9 9h10v10H9zM5 15V5h10',
  down: 'M12 4v11M7 11l5 5 5-5M5 20h14',
  link: 'M10 14a4 4 0 0 0 6 0l3-3a4 4 0 0 0-6-6l-1 1M14 10a4 4 0 0 0-6 0l-3 3a4 4 0 0 0 6 6l1-1',
  close: 'M6 6l12 12M18 6 6 18',
};

export function icon(name: string): SVGElement {
  return svg('svg', { viewBox: '0 0 24 24', width: 18, height: 18, class: 'icon', 'aria-hidden': 'true' }, svg('path', { d: kIcons[name] ?? '' }));
}

/** A button with a picture. Its words are shown only where `label` says so. */
export function iconButton(name: string, words: string, onclick: () => void, label = false): HTMLButtonElement {
  return h('button', { type: 'button', class: label ? 'button' : 'button quiet', title: words, 'aria-label': words, onclick }, icon(name), label && words);
}

/** A folded part of the panel. */
export function section(id: string, title: string, open: boolean, ...children: Child[]): HTMLDetailsElement {
  return h('details', { class: 'section', id, open }, h('summary', {}, h('h2', {}, title)), h('div', { class: 'section-body' }, ...children));
}

/** Opens a part of the panel and brings it into view. */
export function unfold(id: string): void {
  const element = document.getElementById(id);
  element?.setAttribute('open', '');
  element?.scrollIntoView({ block: 'nearest' });
}
