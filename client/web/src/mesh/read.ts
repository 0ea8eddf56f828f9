import { readGlb } from './glb';
import { readObj, readOff, readStlText } from './read_text';
import { readPly } from './read_ply';
import { smoothNormals, type Surface } from './surface';

/** What the readers give: corners of polygons are already triangles. */
export interface Triangles {
  positions: Float64Array;
  index: Uint32Array;
}

/**
 * Reads a file for the eye only, before the service has looked at it. The service decides what is in it; what this
 * cannot read is shown once the service has.
 */
export function readMesh(bytes: ArrayBuffer, name: string): Surface {
  const extension = name.toLowerCase().match(/\.([a-z0-9]+)$/)?.[1] ?? '';
  const head = new TextDecoder('latin1').decode(new Uint8Array(bytes, 0, Math.min(512, bytes.byteLength)));
  if (head.startsWith('glTF')) return readGlb(bytes);
  return centred(read(bytes, head, extension));
}

function read(bytes: ArrayBuffer, head: string, extension: string): Triangles {
  if (/^ply\s/.test(head)) return readPly(bytes);
  if (/^\s*(ST|C|N|4|n)*OFF\b/.test(head)) return readOff(bytes);
  if (extension === 'stl' || isBinaryStl(bytes)) {
    return isBinaryStl(bytes) ? readStlBinary(bytes) : readStlText(bytes);
  }
  if (extension === 'obj' || /^\s*(#|v |o |g |mtllib|vn )/m.test(head)) return readObj(bytes);
  throw new Error('a preview of this format needs the service');
}

/** Single precision is kept for what matters by moving the mesh to the origin. */
function centred({ positions, index }: Triangles): Surface {
  if (index.length === 0) throw new Error('no faces');
  const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
  for (let i = 0; i < positions.length; ++i) {
    low[i % 3] = Math.min(low[i % 3]!, positions[i]!);
    high[i % 3] = Math.max(high[i % 3]!, positions[i]!);
  }
  const extent = Math.max(...high.map((x, k) => x - low[k]!));
  const far = Math.max(...high.map(Math.abs), ...low.map(Math.abs)) > 100 * extent;
  const origin = (far ? high.map((x, k) => (x + low[k]!) / 2) : [0, 0, 0]) as [number, number, number];
  const single = new Float32Array(positions.length);
  for (let i = 0; i < positions.length; ++i) single[i] = positions[i]! - origin[i % 3]!;
  return { positions: single, index, normals: smoothNormals(single, index), origin };
}

function isBinaryStl(bytes: ArrayBuffer): boolean {
  if (bytes.byteLength < 84) return false;
  return bytes.byteLength === 84 + 50 * new DataView(bytes).getUint32(80, true);
}

function readStlBinary(bytes: ArrayBuffer): Triangles {
  const data = new DataView(bytes);
  const faces = data.getUint32(80, true);
  const weld = new Weld(9 * faces);
  for (let f = 0; f < faces; ++f) {
    for (let k = 0; k < 3; ++k) {
      const at = 84 + 50 * f + 12 + 12 * k;
      weld.add(data.getFloat32(at, true), data.getFloat32(at + 4, true), data.getFloat32(at + 8, true));
    }
  }
  return weld.triangles();
}

/** Makes one vertex of corners at the same place. */
export class Weld {
  private readonly known = new Map<string, number>();
  private readonly positions: number[] = [];
  private readonly index: number[] = [];

  constructor(_expected: number) {}

  add(x: number, y: number, z: number): void {
    const key = `${x},${y},${z}`;
    let vertex = this.known.get(key);
    if (vertex === undefined) {
      vertex = this.known.size;
      this.known.set(key, vertex);
      this.positions.push(x, y, z);
    }
    this.index.push(vertex);
  }

  triangles(): Triangles {
    return { positions: Float64Array.from(this.positions), index: Uint32Array.from(this.index) };
  }
}
