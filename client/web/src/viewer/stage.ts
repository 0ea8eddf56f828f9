import { Color, Scene, Vector3, WebGLRenderer } from 'three';
import { boundsOf, facing, type Bounds, type Surface } from '../mesh/surface';
import { Orbit } from './camera';
import { Layer } from './layer';
import { pick, type Hit } from './pick';

/** What is on the stage: one mesh, two with a divider between them, or two beside each other. */
export type Arrangement = 'before' | 'after' | 'divided' | 'beside';

// How long the hand has to rest before the next finer picture is drawn. Without a graphics card the whole of a large mesh
// takes a second or more, in which nothing moves.
const kRestMs = 180, kLongRestMs = 900;
// Noise and spikes change the extent of a mesh by less than this share of it.
const kSameExtent = 0.25;

/** The canvas with its two meshes. Draws only when something has changed. */
export class Stage {
  readonly orbit: Orbit;
  readonly before = new Layer();
  readonly after = new Layer();
  private made?: WebGLRenderer;
  /** Whether the processor draws, for want of a graphics card. */
  private slow = false;
  /** Set while something other than the camera is dragged that changes the picture. */
  held = false;
  private readonly scenes = { before: new Scene(), after: new Scene() };
  private arrangementNow: Arrangement = 'after';
  private dividerAt = 0.5;
  private pending = false;
  private resting = 0;
  private bounds: Bounds = { centre: [0, 0, 0], radius: 1 };
  private originNow: [number, number, number] = [0, 0, 0];
  /** Called after each picture, to move what lies over the canvas. */
  onDraw: () => void = () => undefined;

  constructor(readonly canvas: HTMLCanvasElement) {
    this.orbit = new Orbit(() => this.redrawMoving());
    this.orbit.attach(canvas);
    this.scenes.before.add(this.before.group);
    this.scenes.after.add(this.after.group);
    new ResizeObserver(() => this.resize()).observe(canvas.parentElement!);
    this.resize();
  }

  /** Graphics take the longest to start, so the page is there before they are. */
  private get renderer(): WebGLRenderer {
    if (this.made) return this.made;
    this.slow = drawnByProcessor();
    const renderer = new WebGLRenderer({ canvas: this.canvas, antialias: this.isSmoothed(), alpha: true, preserveDrawingBuffer: false });
    renderer.setPixelRatio(this.pixelRatio());
    renderer.autoClear = false;
    renderer.localClippingEnabled = true;
    renderer.setClearColor(new Color(0), 0);
    this.made = renderer;
    this.resize();
    return renderer;
  }

  get arrangement(): Arrangement {
    return this.arrangementNow;
  }
  set arrangement(value: Arrangement) {
    this.arrangementNow = value;
    this.resize();
  }
  get divider(): number {
    return this.dividerAt;
  }
  set divider(value: number) {
    this.dividerAt = Math.min(1, Math.max(0, value));
    this.redrawMoving();
  }
  get size(): number {
    return this.bounds.radius;
  }
  get middle(): readonly [number, number, number] {
    return this.bounds.centre;
  }

  /** Puts a new mesh on the stage and looks at it. */
  open(surface: Surface, which: 'before' | 'after' = 'before'): void {
    this.originNow = surface.origin;
    this.bounds = boundsOf(surface.positions);
    this.before.clear();
    this.after.clear();
    this[which].setSurface(surface, this.originNow);
    this.arrangement = which;
    this.orbit.lookFrom(facing(surface));
    this.orbit.frame(this.bounds);
  }

  show(which: 'before' | 'after', surface: Surface): void {
    this[which].setSurface(surface, this.originNow);
    this.redraw();
  }

  /** Looks at a surface anew where it has another extent than what was looked at, such as a preview of a part of it. */
  lookAgain(surface: Surface): void {
    const { centre, radius } = boundsOf(surface.positions);
    const moved = centre.map((x, k) => x + surface.origin[k]! - this.originNow[k]!) as [number, number, number];
    const apart = Math.hypot(...moved.map((x, k) => x - this.bounds.centre[k]!));
    if (apart + Math.abs(radius - this.bounds.radius) < kSameExtent * this.bounds.radius) return;
    this.bounds = { centre: moved, radius };
    this.reframe();
  }

  /** Everything in view again, as it was at first. */
  reframe(): void {
    this.orbit.frame(this.bounds);
  }

  clear(): void {
    this.before.clear();
    this.after.clear();
    this.redraw();
  }

  redraw(): void {
    if (this.pending) return;
    this.pending = true;
    requestAnimationFrame(() => {
      this.pending = false;
      this.draw();
    });
  }

  /** Draws what changes with every move of a hand: large meshes with few faces, and whole once the hand rests. */
  redrawMoving(): void {
    this.detail = this.slow ? 2 : 1;
    this.redraw();
    this.rest();
  }

  private rest(): void {
    clearTimeout(this.resting);
    const wait = this.slow && this.detailNow === 1 ? kLongRestMs : kRestMs;
    this.resting = window.setTimeout(() => {
      if (this.orbit.dragging || this.held) return this.rest();
      this.detail = Math.max(0, this.detail - 1); // a picture may have been taken in between
      this.redraw();
      if (this.detail > 0) this.rest();
    }, wait);
  }

  private detailNow = 0;
  private get detail(): number {
    return this.detailNow;
  }
  private set detail(level: number) {
    this.detailNow = level;
    this.before.detail = level;
    this.after.detail = level;
    // Only where it changes: it takes new buffers.
    if (this.made && this.made.getPixelRatio() !== this.pixelRatio()) this.made.setPixelRatio(this.pixelRatio());
  }

  private pixelRatio(): number {
    const coarsest = this.detailNow === 2 && this.hasLarge();
    return Math.min(2, window.devicePixelRatio) * (coarsest ? 0.5 : 1);
  }

  private hasLarge(): boolean {
    return [this.before, this.after].some((layer) => layer.surface?.coarse);
  }

  /** Smooth outlines triple what a large mesh costs a processor. */
  private isSmoothed(): boolean {
    return !this.slow || !this.hasLarge();
  }

  /** The mesh that lies at a point of the canvas, and that part of the canvas, in CSS pixels. */
  private paneAt(x: number): { which: 'before' | 'after'; left: number; width: number } {
    const width = this.canvas.clientWidth;
    if (this.arrangementNow === 'beside') {
      const half = width / 2;
      return x < half ? { which: 'before', left: 0, width: half } : { which: 'after', left: half, width: half };
    }
    const before = this.arrangementNow === 'before' || (this.arrangementNow === 'divided' && x < this.dividerAt * width);
    return { which: before ? 'before' : 'after', left: 0, width };
  }

  /** What lies under a point of the canvas, in CSS pixels. */
  pick(x: number, y: number): (Hit & { which: 'before' | 'after' }) | undefined {
    const { which, left, width } = this.paneAt(x);
    const layer = this[which];
    if (!layer.surface || !layer.group.visible) return undefined;
    const { camera } = this.orbit, offset = layer.group.position;
    const towards = new Vector3(((x - left) / width) * 2 - 1, 1 - (y / this.canvas.clientHeight) * 2, 0.5).unproject(camera);
    const direction = towards.sub(camera.position).normalize();
    const hit = pick(layer.surface, layer.material.section, camera.position.clone().sub(offset).toArray(), direction.toArray());
    return hit && { ...hit, which };
  }

  /** Where a point of a mesh is on the canvas, in CSS pixels. */
  project(point: readonly [number, number, number], which: 'before' | 'after'): { x: number; y: number } {
    const at = new Vector3(...point).add(this[which].group.position).project(this.orbit.camera);
    const beside = this.arrangementNow === 'beside';
    const width = this.canvas.clientWidth / (beside ? 2 : 1);
    const left = beside && which === 'after' ? width : 0;
    return { x: left + ((at.x + 1) / 2) * width, y: ((1 - at.y) / 2) * this.canvas.clientHeight };
  }

  /** A picture of the stage as it is, over a colour. */
  async picture(background: string): Promise<Blob> {
    this.detail = 0;
    this.draw();
    const { canvas } = this;
    const copy = document.createElement('canvas');
    copy.width = canvas.width;
    copy.height = canvas.height;
    const context = copy.getContext('2d')!;
    context.fillStyle = background;
    context.fillRect(0, 0, copy.width, copy.height);
    context.drawImage(canvas, 0, 0);
    return new Promise((resolve, reject) =>
      copy.toBlob((blob) => (blob ? resolve(blob) : reject(new Error('no picture'))), 'image/png'),
    );
  }

  private resize(): void {
    const holder = this.canvas.parentElement!;
    const width = Math.max(1, holder.clientWidth), height = Math.max(1, holder.clientHeight);
    this.made?.setSize(width, height, false);
    this.orbit.resize(width / (this.arrangementNow === 'beside' ? 2 : 1) / height);
    this.redraw();
  }

  private draw(): void {
    if (!this.made && !this.before.surface && !this.after.surface) return;
    const { renderer, canvas } = this;
    const width = canvas.clientWidth, height = canvas.clientHeight;
    renderer.setRenderTarget(null);
    renderer.setScissorTest(false);
    renderer.setViewport(0, 0, width, height);
    renderer.clear();
    if (this.arrangementNow === 'beside') {
      this.pane('before', 0, width / 2, 0, width / 2);
      this.pane('after', width / 2, width / 2, width / 2, width / 2);
    } else if (this.arrangementNow === 'divided') {
      const at = Math.round(this.dividerAt * width);
      this.pane('before', 0, width, 0, at);
      this.pane('after', 0, width, at, width - at);
    } else this.pane(this.arrangementNow, 0, width, 0, width);
    renderer.setScissorTest(false);
    this.onDraw();
  }

  private pane(which: 'before' | 'after', left: number, width: number, from: number, visible: number): void {
    if (visible <= 0) return;
    const { renderer } = this;
    const height = this.canvas.clientHeight;
    renderer.setViewport(left, 0, width, height);
    renderer.setScissor(from, 0, visible, height);
    renderer.setScissorTest(true);
    renderer.render(this.scenes[which], this.orbit.camera);
  }
}

function drawnByProcessor(): boolean {
  const gl = document.createElement('canvas').getContext('webgl2');
  const known = gl?.getExtension('WEBGL_debug_renderer_info');
  const name = gl && known ? String(gl.getParameter(known.UNMASKED_RENDERER_WEBGL)) : '';
  gl?.getExtension('WEBGL_lose_context')?.loseContext();
  return /swiftshader|llvmpipe|softpipe|software|basic render/i.test(name);
}
