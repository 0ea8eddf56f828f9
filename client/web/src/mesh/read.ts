import { readGltf } from './gltf';
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
  return centred(read(bytes, head, extension));
}

function read(bytes: ArrayBuffer, head: string, extension: string): Triangles {
  if (/^(glTF|\s*\{)/.test(head)) return readGltf(bytes);
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
  const weld = new Weld(3 * faces);
  for (let f = 0; f < faces; ++f) {
    for (let k = 0; k < 3; ++k) {
      const at = 84 + 50 * f + 12 + 12 * k;
      weld.add(data.getFloat32(at, true), data.getFloat32(at + 4, true), data.getFloat32(at + 8, true));
    }
  }
  return weld.triangles();
}

/** Makes one vertex of corners at the same place: a table of vertices by the bits of their coordinates. */
export class Weld {
  private readonly bits = new Uint32Array(3);
  private readonly place = new Float32Array(this.bits.buffer);
  private positions: Float32Array;
  private index: Uint32Array;
  private table: Int32Array;
  private vertices = 0;
  private corners = 0;

  constructor(expected: number) {
    this.index = new Uint32Array(Math.max(16, expected));
    this.positions = new Float32Array(3 * Math.max(16, expected >> 2));
    this.table = new Int32Array(64).fill(-1);
  }

  add(x: number, y: number, z: number): void {
    this.place[0] = x + 0; // not −0
    this.place[1] = y + 0;
    this.place[2] = z + 0;
    if (2 * this.vertices >= this.table.length) this.widen();
    let slot = this.slot(), vertex = this.table[slot]!;
    while (vertex >= 0 && !this.isAt(vertex)) {
      slot = (slot + 1) & (this.table.length - 1);
      vertex = this.table[slot]!;
    }
    if (vertex < 0) {
      vertex = this.table[slot] = this.vertices++;
      if (3 * this.vertices > this.positions.length) this.positions = larger(this.positions, new Float32Array(2 * this.positions.length));
      this.positions.set(this.place, 3 * vertex);
    }
    if (this.corners === this.index.length) this.index = larger(this.index, new Uint32Array(2 * this.index.length));
    this.index[this.corners++] = vertex;
  }

  triangles(): Triangles {
    return { positions: Float64Array.from(this.positions.subarray(0, 3 * this.vertices)), index: this.index.slice(0, this.corners - (this.corners % 3)) };
  }

  private slot(): number {
    const [a, b, c] = this.bits as unknown as [number, number, number];
    const mixed = Math.imul(a, 0x9e3779b1) ^ Math.imul(b, 0x85ebca6b) ^ Math.imul(c, 0xc2b2ae35);
    return (mixed ^ (mixed >>> 15)) & (this.table.length - 1);
  }

  private isAt(vertex: number): boolean {
    const { positions, place } = this;
    return positions[3 * vertex] === place[0] && positions[3 * vertex + 1] === place[1] && positions[3 * vertex + 2] === place[2];
  }

  private widen(): void {
    this.table = new Int32Array(4 * this.table.length).fill(-1);
    const place = this.place.slice();
    for (let v = 0; v < this.vertices; ++v) {
      this.place.set(this.positions.subarray(3 * v, 3 * v + 3));
      let slot = this.slot();
      while (this.table[slot]! >= 0) slot = (slot + 1) & (this.table.length - 1);
      this.table[slot] = v;
    }
    this.place.set(place);
  }
}

function larger<T extends Float32Array | Uint32Array>(from: T, to: T): T {
  to.set(from);
  return to;
}
