import { BufferAttribute, BufferGeometry, Group, LineSegments, LineBasicMaterial, Mesh, Plane, Vector3, Color } from 'three';
import { LineMaterial } from 'three/examples/jsm/lines/LineMaterial.js';
import { LineSegments2 } from 'three/examples/jsm/lines/LineSegments2.js';
import { LineSegmentsGeometry } from 'three/examples/jsm/lines/LineSegmentsGeometry.js';
import { picked } from '../mesh/coarse';
import type { Surface } from '../mesh/surface';
import { SurfaceMaterial, type Colouring } from './material';

/** Ridge edges, the most certain first, so that a threshold is a number of edges. */
export interface RidgeEdges {
  edges: Uint32Array;
  labels: Float64Array | Float32Array;
}

/** Puts the most certain first. */
export function sortedRidges(edges: Uint32Array, labels: ArrayLike<number>): RidgeEdges {
  const order = Uint32Array.from({ length: labels.length }, (_, i) => i).sort((a, b) => labels[b]! - labels[a]!);
  const sorted = { edges: new Uint32Array(2 * order.length), labels: new Float64Array(order.length) };
  order.forEach((from, to) => {
    sorted.labels[to] = labels[from]!;
    sorted.edges[2 * to] = edges[2 * from]!;
    sorted.edges[2 * to + 1] = edges[2 * from + 1]!;
  });
  return sorted;
}

const kPale = new Color('#eda183');
const kStrong = new Color('#cf3313');

const kRidgesAtCoarsest = 800;

// How much nearer to the eye lines are drawn, as a share of their distance.
const kLineNearer = 0.004;

/**
 * Lets a material draw nearer to the eye, in the same places of the picture. A line on an edge is half behind the faces
 * of that edge; an offset of the faces instead would let those behind a silhouette come through.
 */
function bringNearer(material: LineMaterial | LineBasicMaterial, share: number): void {
  material.onBeforeCompile = (shader) => {
    shader.vertexShader = shader.vertexShader.replace(/}\s*$/, `  gl_Position.z += projectionMatrix[3][2] * ${share.toFixed(5)};\n}`);
  };
  material.customProgramCacheKey = () => `nearer by ${share}`;
}

/** One mesh on the stage: its surface, ridges and wires. */
export class Layer {
  readonly group = new Group();
  readonly material = new SurfaceMaterial();
  private geometry = new BufferGeometry();
  private readonly mesh: Mesh;
  /** What is drawn in place of `mesh` while it is turned, finest first; each has buffers of its own. */
  private coarse: Mesh[] = [];
  private lines?: LineSegments2;
  private wires?: LineSegments;
  private lit?: LineSegments2;
  private ridges?: RidgeEdges;
  private readonly lineMaterial = new LineMaterial({ linewidth: 2.6, vertexColors: true });
  private readonly litMaterial = new LineMaterial({ linewidth: 6, color: 0xffb020 });
  private readonly wireMaterial = new LineBasicMaterial({ color: 0x000000, transparent: true, opacity: 0.22 });
  private readonly clip = new Plane(new Vector3(0, 0, -1), 1e30);
  surface?: Surface;

  constructor() {
    this.mesh = new Mesh(this.geometry, this.material);
    this.mesh.frustumCulled = false;
    this.group.add(this.mesh);
    for (const material of [this.lineMaterial, this.litMaterial, this.wireMaterial]) material.clippingPlanes = [this.clip];
    bringNearer(this.lineMaterial, kLineNearer);
    bringNearer(this.litMaterial, 2 * kLineNearer);
    bringNearer(this.wireMaterial, kLineNearer / 2);
    this.group.visible = false;
  }

  setSurface(surface: Surface, origin: [number, number, number]): void {
    this.surface = surface;
    this.geometry.dispose();
    this.geometry = geometryOf(surface);
    this.mesh.geometry = this.geometry;
    for (const mesh of this.coarse) {
      mesh.geometry.dispose();
      this.group.remove(mesh);
    }
    this.coarse = (surface.coarse ?? []).map((level) => {
      const mesh = new Mesh(geometryOf(level), this.material);
      mesh.frustumCulled = false;
      this.group.add(mesh);
      return mesh;
    });
    this.detail = 0;
    this.group.position.set(...(surface.origin.map((x, k) => x - origin[k]!) as [number, number, number]));
    this.group.visible = true;
    this.setColouring();
    this.dropWires();
    this.drop('lines');
    this.drop('lit');
  }

  setColouring(colouring?: Colouring): void {
    if (colouring) {
      setValues(this.geometry, colouring.values);
      this.surface?.coarse?.forEach(({ vertices }, level) => setValues(this.coarse[level]!.geometry, picked(colouring.values, 1, vertices)));
    }
    this.material.setColouring(colouring);
  }

  /**
   * How coarsely a large mesh is drawn: 0 is whole; at 1 and 2 few faces stand for it, without wires. At 2 only the most
   * certain ridges are drawn, too.
   */
  set detail(level: number) {
    const drawn = Math.min(level, this.coarse.length);
    this.mesh.visible = drawn === 0;
    this.coarse.forEach((mesh, k) => (mesh.visible = k + 1 === drawn));
    if (this.wires) this.wires.visible = drawn === 0;
    this.mostRidges = drawn === 2 ? kRidgesAtCoarsest : Infinity;
    this.drawRidges();
  }

  setRidges(ridges: RidgeEdges): void {
    this.drop('lines');
    this.ridges = ridges;
    const count = ridges.labels.length;
    if (count === 0) return;
    const colours = new Float32Array(6 * count);
    const colour = new Color();
    for (let e = 0; e < count; ++e) {
      colour.copy(kPale).lerp(kStrong, Math.min(1, Math.max(0, (ridges.labels[e]! - 0.2) / 0.7)));
      for (const at of [6 * e, 6 * e + 3]) colours.set([colour.r, colour.g, colour.b], at);
    }
    const geometry = new LineSegmentsGeometry();
    geometry.setPositions(this.segments(ridges.edges));
    geometry.setColors(colours);
    this.lines = this.added(new LineSegments2(geometry, this.lineMaterial));
    this.ridgesWanted = count;
    this.drawRidges();
  }

  /** Draws the edges with at least this label. Returns how many. */
  setThreshold(threshold: number): number {
    if (!this.ridges) return 0;
    const { labels } = this.ridges;
    let low = 0, high = labels.length;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (labels[middle]! >= threshold) low = middle + 1;
      else high = middle;
    }
    this.ridgesWanted = low;
    this.drawRidges();
    return low;
  }

  private ridgesShown = true;
  private ridgesWanted = 0;
  private mostRidges = Infinity;
  showRidges(on: boolean): void {
    this.ridgesShown = on;
    this.drawRidges();
  }

  private drawRidges(): void {
    if (!this.lines) return;
    this.lines.geometry.instanceCount = Math.min(this.ridgesWanted, this.mostRidges);
    this.lines.visible = this.ridgesShown && this.ridgesWanted > 0;
  }

  /** Lights up a chain of vertices; undefined puts it out. */
  light(vertices?: readonly number[], closed = false): void {
    this.drop('lit');
    if (!vertices || vertices.length < 2) return;
    const edges: number[] = [];
    for (let k = 1; k < vertices.length; ++k) edges.push(vertices[k - 1]!, vertices[k]!);
    if (closed) edges.push(vertices.at(-1)!, vertices[0]!);
    const geometry = new LineSegmentsGeometry();
    geometry.setPositions(this.segments(edges));
    this.lit = this.added(new LineSegments2(geometry, this.litMaterial));
  }

  showWires(on: boolean): void {
    if (!on) return this.dropWires();
    if (this.wires || !this.surface) return;
    const geometry = new BufferGeometry();
    geometry.setAttribute('position', this.geometry.getAttribute('position'));
    geometry.setIndex(new BufferAttribute(edgesOf(this.surface.index), 1));
    this.wires = new LineSegments(geometry, this.wireMaterial);
    this.wires.frustumCulled = false;
    this.group.add(this.wires);
  }

  /** Cuts away what is on the far side of a plane, given in the coordinates of the mesh. */
  setSection(plane: [number, number, number, number]): void {
    this.material.setSection(plane);
    const [x, y, z, w] = plane;
    this.clip.set(new Vector3(-x, -y, -z), -w);
    this.clip.applyMatrix4(this.group.matrixWorld);
  }

  setTheme(clay: string, inside: string, wire: string): void {
    this.material.setClay(clay, inside);
    this.wireMaterial.color.set(wire);
  }

  clear(): void {
    this.group.visible = false;
    this.dropWires();
    this.drop('lines');
    this.drop('lit');
    delete this.surface;
  }

  private segments(edges: ArrayLike<number>): Float32Array {
    const { positions } = this.surface!;
    const points = new Float32Array(3 * edges.length);
    for (let k = 0; k < edges.length; ++k) {
      const v = 3 * edges[k]!;
      points[3 * k] = positions[v]!;
      points[3 * k + 1] = positions[v + 1]!;
      points[3 * k + 2] = positions[v + 2]!;
    }
    return points;
  }

  private added(lines: LineSegments2): LineSegments2 {
    lines.frustumCulled = false;
    this.group.add(lines);
    return lines;
  }

  private drop(which: 'lines' | 'lit'): void {
    const lines = this[which];
    if (!lines) return;
    this.group.remove(lines);
    lines.geometry.dispose();
    delete this[which];
  }

  private dropWires(): void {
    if (!this.wires) return;
    this.group.remove(this.wires);
    this.wires.geometry.deleteAttribute('position'); // stays with the surface
    this.wires.geometry.dispose();
    delete this.wires;
  }
}

function geometryOf({ positions, normals, index }: Pick<Surface, 'positions' | 'normals' | 'index'>): BufferGeometry {
  const geometry = new BufferGeometry();
  geometry.setAttribute('position', new BufferAttribute(positions, 3));
  geometry.setAttribute('normal', new BufferAttribute(normals, 3));
  geometry.setAttribute('value', new BufferAttribute(new Float32Array(positions.length / 3), 1));
  geometry.setIndex(faces(index));
  return geometry;
}

function setValues(geometry: BufferGeometry, values: Float32Array): void {
  const value = geometry.getAttribute('value') as BufferAttribute;
  value.array.set(values);
  value.needsUpdate = true;
}

// Two meshes with the same faces have one buffer of them.
const known = new WeakMap<Uint32Array, BufferAttribute>();
function faces(index: Uint32Array): BufferAttribute {
  let attribute = known.get(index);
  if (!attribute) {
    attribute = new BufferAttribute(index, 1);
    known.set(index, attribute);
  }
  return attribute;
}

/** Each edge of the triangles; those inside are there once, as faces on both sides run through them in opposite ways. */
function edgesOf(index: Uint32Array): Uint32Array {
  const edges = new Uint32Array(2 * index.length);
  let count = 0;
  for (let f = 0; f < index.length; f += 3) {
    for (let k = 0; k < 3; ++k) {
      const a = index[f + k]!, b = index[f + ((k + 1) % 3)]!;
      if (a > b) continue;
      edges[count++] = a;
      edges[count++] = b;
    }
  }
  return edges.slice(0, count);
}
