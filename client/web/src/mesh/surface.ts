import type { Coarse } from './coarse';

/** A triangle mesh as the page draws it. */
export interface Surface {
  /** x, y, z of each vertex, relative to `origin`. */
  positions: Float32Array;
  normals: Float32Array;
  /** Three vertices of each face. */
  index: Uint32Array;
  /** What stands for the surface while it is turned, finest first; only of large meshes. */
  coarse?: Coarse[];
  origin: [number, number, number];
  /** Only in what the service made: per vertex, where a vertex is one of several copies along a ridge. */
  label?: Float32Array;
  vertexClass?: Float32Array;
  segment?: Float32Array;
  /** How far each vertex may be off along its normal, in units of the upload; only where the job was asked for it. */
  sigma?: Float32Array;
  /** The vertex of the upload that each is a copy of. */
  source?: Float32Array;
  /** Two vertices of each ridge edge. */
  ridges?: Uint32Array;
}

export const vertexCount = (surface: Surface): number => surface.positions.length / 3;
export const faceCount = (surface: Surface): number => surface.index.length / 3;

/** Normals of the vertices, weighted by area. */
export function smoothNormals(positions: Float32Array, index: Uint32Array): Float32Array {
  const normals = new Float32Array(positions.length);
  for (let f = 0; f < index.length; f += 3) {
    const a = 3 * index[f]!, b = 3 * index[f + 1]!, c = 3 * index[f + 2]!;
    const ux = positions[b]! - positions[a]!, uy = positions[b + 1]! - positions[a + 1]!, uz = positions[b + 2]! - positions[a + 2]!;
    const vx = positions[c]! - positions[a]!, vy = positions[c + 1]! - positions[a + 1]!, vz = positions[c + 2]! - positions[a + 2]!;
    const nx = uy * vz - uz * vy, ny = uz * vx - ux * vz, nz = ux * vy - uy * vx;
    for (const corner of [a, b, c]) {
      normals[corner]! += nx;
      normals[corner + 1]! += ny;
      normals[corner + 2]! += nz;
    }
  }
  for (let v = 0; v < normals.length; v += 3) {
    const length = Math.hypot(normals[v]!, normals[v + 1]!, normals[v + 2]!) || 1;
    normals[v]! /= length;
    normals[v + 1]! /= length;
    normals[v + 2]! /= length;
  }
  return normals;
}

// Of a half-sphere, the mean of the normals has half the length of one.
const kFacesOneWay = 0.4, kFacesLookedAt = 50_000;

export interface Bounds {
  centre: [number, number, number];
  radius: number;
}

/** Where an open surface faces: the mean of its normals, or nothing for one that faces all ways. */
export function facing({ positions, index }: Surface): [number, number, number] | undefined {
  const sum: [number, number, number] = [0, 0, 0];
  let area = 0;
  // Some faces of a large mesh are enough.
  const step = 3 * Math.ceil(index.length / 3 / kFacesLookedAt);
  for (let f = 0; f < index.length; f += step) {
    const [a, b, c] = [3 * index[f]!, 3 * index[f + 1]!, 3 * index[f + 2]!];
    const u = [0, 1, 2].map((k) => positions[b + k]! - positions[a + k]!), v = [0, 1, 2].map((k) => positions[c + k]! - positions[a + k]!);
    const normal = [u[1]! * v[2]! - u[2]! * v[1]!, u[2]! * v[0]! - u[0]! * v[2]!, u[0]! * v[1]! - u[1]! * v[0]!];
    normal.forEach((x, k) => { sum[k]! += x; });
    area += Math.hypot(...normal);
  }
  const length = Math.hypot(...sum);
  return length > kFacesOneWay * area ? (sum.map((x) => x / length) as [number, number, number]) : undefined;
}

export function boundsOf(positions: Float32Array): Bounds {
  const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
  for (let i = 0; i < positions.length; i += 3) {
    for (let k = 0; k < 3; ++k) {
      const x = positions[i + k]!;
      if (x < low[k]!) low[k] = x;
      if (x > high[k]!) high[k] = x;
    }
  }
  if (!Number.isFinite(low[0]!)) return { centre: [0, 0, 0], radius: 1 };
  const centre = low.map((x, k) => (x + high[k]!) / 2) as [number, number, number];
  let squared = 0;
  for (let i = 0; i < positions.length; i += 3) {
    const dx = positions[i]! - centre[0], dy = positions[i + 1]! - centre[1], dz = positions[i + 2]! - centre[2];
    squared = Math.max(squared, dx * dx + dy * dy + dz * dz);
  }
  return { centre, radius: Math.sqrt(squared) || 1 };
}
