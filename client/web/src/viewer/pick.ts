import type { Surface } from '../mesh/surface';

export interface Hit {
  face: number;
  /** Of the drawn mesh, the nearest one. */
  vertex: number;
  /** The ends of the nearest edge. */
  edge: [number, number];
  point: [number, number, number];
}

type Vector = readonly [number, number, number];

// How far outside a face a ray may meet its plane, so that none slips through between two faces.
const kSlack = 1e-6;

/**
 * The first face that a ray meets, of those that the section leaves. Looks at every face, which takes some hundredths of
 * a second for two million; a tree over the faces would take as much memory as they do.
 */
export function pick(surface: Surface, section: readonly number[], [ox, oy, oz]: Vector, [dx, dy, dz]: Vector): Hit | undefined {
  const { positions, index } = surface;
  const [sx, sy, sz, sw] = section as [number, number, number, number];
  let face = -1, nearest = Infinity, u = 0, v = 0;
  for (let f = 0; f < index.length; f += 3) {
    const a = 3 * index[f]!, b = 3 * index[f + 1]!, c = 3 * index[f + 2]!;
    const ax = positions[a]!, ay = positions[a + 1]!, az = positions[a + 2]!;
    const px = positions[b]! - ax, py = positions[b + 1]! - ay, pz = positions[b + 2]! - az;
    const qx = positions[c]! - ax, qy = positions[c + 1]! - ay, qz = positions[c + 2]! - az;
    // Möller and Trumbore (1997): the barycentric weights of where the ray meets the plane.
    const hx = dy * qz - dz * qy, hy = dz * qx - dx * qz, hz = dx * qy - dy * qx;
    const det = px * hx + py * hy + pz * hz;
    if (det === 0) continue;
    const tx = ox - ax, ty = oy - ay, tz = oz - az;
    const s = (tx * hx + ty * hy + tz * hz) / det;
    if (s < -kSlack || s > 1 + kSlack) continue;
    const wx = ty * pz - tz * py, wy = tz * px - tx * pz, wz = tx * py - ty * px;
    const t = (dx * wx + dy * wy + dz * wz) / det;
    if (t < -kSlack || s + t > 1 + kSlack) continue;
    const distance = (qx * wx + qy * wy + qz * wz) / det;
    if (distance <= 0 || distance >= nearest) continue;
    if (sx * (ox + distance * dx) + sy * (oy + distance * dy) + sz * (oz + distance * dz) + sw > 0) continue;
    [face, nearest, u, v] = [f / 3, distance, s, t];
  }
  if (face < 0) return undefined;
  const weights = [1 - u - v, u, v], corners = [0, 1, 2].map((k) => index[3 * face + k]!);
  const close = weights.indexOf(Math.max(...weights)), far = weights.indexOf(Math.min(...weights));
  return {
    face,
    vertex: corners[close]!,
    edge: [corners[(far + 1) % 3]!, corners[(far + 2) % 3]!],
    point: [ox + nearest * dx, oy + nearest * dy, oz + nearest * dz],
  };
}
