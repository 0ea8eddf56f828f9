import type { Surface } from './surface';
import { boundsOf } from './surface';

/** Meshes with fewer faces are drawn whole at any time. */
const kLeastFaces = 400_000;
// Cells across the mesh: about twice six times the square of this are the faces at most that are left.
const kCells = 110;

/**
 * Faces for while the mesh is turned: of the vertices in one cell of a grid whose normals point into one octant, one
 * stands for all. The faces use the vertices of the surface. Undefined for meshes that need none.
 */
export function coarseIndex({ positions, normals, index }: Surface): Uint32Array | undefined {
  if (index.length < 3 * kLeastFaces) return undefined;
  const { centre, radius } = boundsOf(positions);
  const cells = kCells + 2, scale = kCells / (2 * radius);
  const first = new Map<number, number>();
  const stands = new Uint32Array(positions.length / 3);
  for (let v = 0; v < stands.length; ++v) {
    let cell = 0, octant = 0;
    for (let k = 0; k < 3; ++k) {
      cell = cell * cells + Math.floor((positions[3 * v + k]! - centre[k]! + radius) * scale);
      octant = 2 * octant + Number(normals[3 * v + k]! > 0);
    }
    const key = 8 * cell + octant, known = first.get(key);
    if (known === undefined) first.set(key, v);
    stands[v] = known ?? v;
  }
  const kept = new Uint32Array(index.length);
  let length = 0;
  for (let f = 0; f < index.length; f += 3) {
    const a = stands[index[f]!]!, b = stands[index[f + 1]!]!, c = stands[index[f + 2]!]!;
    if (a === b || b === c || c === a) continue;
    kept[length++] = a;
    kept[length++] = b;
    kept[length++] = c;
  }
  return kept.slice(0, length);
}
