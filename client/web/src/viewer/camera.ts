import { Matrix4, PerspectiveCamera, Quaternion, Vector3 } from 'three';
import type { Bounds } from '../mesh/surface';

const kTurnPerPixel = 0.006;
const kFieldOfView = 32;
const kCorner = new Vector3(0.62, -0.95, 0.62).normalize();
// Seen this much along z, z cannot be up.
const kSteep = 0.7;

/** A camera that turns freely around a target, by mouse, touch, wheel and keys. Several canvases may share one. */
export class Orbit {
  readonly camera = new PerspectiveCamera(kFieldOfView, 1, 0.01, 100);
  readonly target = new Vector3();
  readonly turn = new Quaternion();
  distance = 5;
  private readonly eye = kCorner.clone();
  private readonly up = new Vector3(0, 0, 1);
  private radius = 1;
  private readonly pointers = new Map<number, { x: number; y: number }>();

  constructor(private readonly changed: () => void) {}

  /** Where `frame` looks from: a little beside this direction, or from a corner of the box without one. */
  lookFrom(direction?: readonly [number, number, number]): void {
    this.eye.copy(kCorner);
    this.up.set(0, 0, 1);
    if (!direction) return;
    const towards = new Vector3(...direction);
    if (Math.abs(towards.z) > kSteep) this.up.set(0, 1, 0);
    const right = this.up.clone().cross(towards).normalize();
    this.eye.copy(towards).addScaledVector(right, 0.3).addScaledVector(towards.clone().cross(right), 0.25).normalize();
  }

  /** Looks at everything. */
  frame({ centre, radius }: Bounds): void {
    this.radius = radius;
    this.target.set(...centre);
    const right = this.up.clone().cross(this.eye).normalize();
    this.turn.setFromRotationMatrix(new Matrix4().makeBasis(right, this.eye.clone().cross(right), this.eye));
    this.distance = this.fitting();
    this.apply();
  }

  private fitting(): number {
    const half = (kFieldOfView * Math.PI) / 360;
    return (this.radius * 1.02) / Math.sin(Math.atan(Math.tan(half) * Math.min(1, this.camera.aspect)));
  }

  resize(aspect: number): void {
    const before = this.fitting();
    this.camera.aspect = aspect;
    this.distance *= this.fitting() / before;
    this.apply();
  }

  apply(): void {
    const { camera } = this;
    camera.quaternion.copy(this.turn);
    camera.position.set(0, 0, this.distance).applyQuaternion(this.turn).add(this.target);
    camera.near = Math.max(this.distance - 2 * this.radius, this.distance / 200);
    camera.far = this.distance + 2 * this.radius;
    camera.updateProjectionMatrix();
    camera.updateMatrixWorld();
    this.changed();
  }

  rotate(dx: number, dy: number): void {
    const turn = new Quaternion().setFromAxisAngle(new Vector3(0, 1, 0), -dx * kTurnPerPixel);
    turn.multiply(new Quaternion().setFromAxisAngle(new Vector3(1, 0, 0), -dy * kTurnPerPixel));
    this.turn.multiply(turn).normalize();
    this.apply();
  }

  roll(angle: number): void {
    this.turn.multiply(new Quaternion().setFromAxisAngle(new Vector3(0, 0, 1), angle));
    this.apply();
  }

  pan(dx: number, dy: number, height: number): void {
    const scale = (2 * this.distance * Math.tan((kFieldOfView * Math.PI) / 360)) / height;
    this.target.add(new Vector3(-dx * scale, dy * scale, 0).applyQuaternion(this.turn));
    this.apply();
  }

  zoom(factor: number): void {
    this.distance = Math.min(Math.max(this.distance * factor, this.radius / 100), this.radius * 40);
    this.apply();
  }

  /** Listens on an element. */
  attach(element: HTMLElement): void {
    element.addEventListener('pointerdown', (event) => {
      if (event.defaultPrevented) return;
      element.setPointerCapture(event.pointerId);
      this.pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
    });
    element.addEventListener('pointermove', (event) => this.move(event, element.clientHeight));
    for (const end of ['pointerup', 'pointercancel'] as const) {
      element.addEventListener(end, (event) => this.pointers.delete(event.pointerId));
    }
    element.addEventListener('contextmenu', (event) => event.preventDefault());
    element.addEventListener(
      'wheel',
      (event) => {
        event.preventDefault();
        this.zoom(Math.exp(Math.max(-80, Math.min(80, event.deltaY)) * 0.002));
      },
      { passive: false },
    );
    element.addEventListener('keydown', (event) => this.key(event, element.clientHeight));
  }

  /** From what is looked at to the eye. */
  get towardsEye(): [number, number, number] {
    return new Vector3(0, 0, 1).applyQuaternion(this.turn).toArray();
  }

  get dragging(): boolean {
    return this.pointers.size > 0;
  }

  private move(event: PointerEvent, height: number): void {
    const last = this.pointers.get(event.pointerId);
    if (!last) return;
    const dx = event.clientX - last.x, dy = event.clientY - last.y;
    if (this.pointers.size === 2) {
      const other = [...this.pointers.entries()].find(([id]) => id !== event.pointerId)![1];
      const before = Math.hypot(last.x - other.x, last.y - other.y);
      const after = Math.hypot(event.clientX - other.x, event.clientY - other.y);
      if (before > 0 && after > 0) this.zoom(before / after);
      this.pan(dx / 2, dy / 2, height);
    } else if (event.buttons & 2 || event.buttons & 4 || event.shiftKey) this.pan(dx, dy, height);
    else this.rotate(dx, dy);
    last.x = event.clientX;
    last.y = event.clientY;
  }

  private key(event: KeyboardEvent, height: number): void {
    if (event.target !== event.currentTarget || event.ctrlKey || event.metaKey || event.altKey) return;
    const moves: Record<string, [number, number]> = {
      ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1],
    };
    const move = moves[event.key];
    if (move) event.shiftKey ? this.pan(-24 * move[0], -24 * move[1], height) : this.rotate(30 * move[0], 30 * move[1]);
    else if (event.key === '+' || event.key === '=') this.zoom(0.9);
    else if (event.key === '-') this.zoom(1 / 0.9);
    else return;
    event.preventDefault();
  }
}
