import type { Surface } from './surface';
import { boundsOf } from './surface';

/** Meshes with fewer faces are drawn whole at any time. */
const kLeastFaces = 400_000;
// Cells across the mesh, finest first: about twice six times the squares of these are the faces at most that are left.
// A graphics card draws the first without effort; a processor in its place can only just draw the second.
const kCells = [110, 32];

/** Few faces that stand for a surface, between some of its vertices. */
export interface Coarse extends Pick<Surface, 'positions' | 'normals' | 'index'> {
  /** The vertices of the surface that are used. */
  vertices: Uint32Array;
}

/** What is drawn while the mesh is turned, finest first; undefined for meshes that need none. */
export function coarsened(surface: Surface): Coarse[] | undefined {
  if (surface.index.length < 3 * kLeastFaces) return undefined;
  const levels: Coarse[] = [];
  let finer: Omit<Coarse, 'vertices'> & Partial<Coarse> = surface;
  for (const cells of kCells) {
    const level = clustered(finer, cells);
    if (finer.vertices) level.vertices = level.vertices.map((v) => finer.vertices![v]!);
    levels.push(level);
    finer = level;
  }
  return levels;
}

/** Of the vertices in one cell of a grid whose normals point into one octant, one stands for all. */
function clustered({ positions, normals, index }: Omit<Coarse, 'vertices'>, across: number): Coarse {
  const { centre, radius } = boundsOf(positions);
  const cells = across + 2, scale = across / (2 * radius);
  const cluster = new Map<number, number>();
  const vertices: number[] = [];
  const clusters = new Uint32Array(positions.length / 3);
  for (let v = 0; v < clusters.length; ++v) {
    let cell = 0, octant = 0;
    for (let k = 0; k < 3; ++k) {
      cell = cell * cells + Math.floor((positions[3 * v + k]! - centre[k]! + radius) * scale);
      octant = 2 * octant + Number(normals[3 * v + k]! > 0);
    }
    const key = 8 * cell + octant;
    let known = cluster.get(key);
    if (known === undefined) {
      known = vertices.push(v) - 1;
      cluster.set(key, known);
    }
    clusters[v] = known;
  }
  const kept: number[] = [];
  for (let f = 0; f < index.length; f += 3) {
    const a = clusters[index[f]!]!, b = clusters[index[f + 1]!]!, c = clusters[index[f + 2]!]!;
    if (a !== b && b !== c && c !== a) kept.push(a, b, c);
  }
  const used = Uint32Array.from(vertices);
  return { vertices: used, positions: picked(positions, 3, used), normals: picked(normals, 3, used), index: Uint32Array.from(kept) };
}

/** The numbers of some vertices, `size` each. */
export function picked(numbers: Float32Array, size: number, vertices: Uint32Array): Float32Array {
  const some = new Float32Array(size * vertices.length);
  vertices.forEach((v, i) => {
    for (let k = 0; k < size; ++k) some[size * i + k] = numbers[size * v + k]!;
  });
  return some;
}
