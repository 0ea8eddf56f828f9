import { Matrix4, Quaternion, Vector3 } from 'three';
import { kMagic, type Accessor } from './glb';
import type { Triangles } from './read';

interface View {
  buffer: number;
  byteOffset?: number;
  byteStride?: number;
}
interface Node {
  mesh?: number;
  skin?: number;
  extensions?: { EXT_mesh_gpu_instancing?: unknown };
  children?: number[];
  matrix?: number[];
  translation?: [number, number, number];
  rotation?: [number, number, number, number];
  scale?: [number, number, number];
}
interface Primitive {
  attributes: Record<string, number>;
  indices?: number;
  mode?: number;
  targets?: unknown[];
}
interface Document {
  accessors: Accessor[];
  bufferViews: View[];
  buffers: { uri?: string }[];
  meshes: { primitives: Primitive[] }[];
  nodes?: Node[];
  scene?: number;
  scenes?: { nodes?: number[] }[];
  extensionsRequired?: string[];
}

const kCompressions = /^(KHR_draco_mesh_compression|EXT_meshopt_compression)$/;
const kTriangles = 4, kStrip = 5, kFan = 6;
const kChunkOfJson = 20;

/**
 * The triangles of the scene of a glTF or GLB file, for the eye. Throws where only the service knows what is meant:
 * compression, sparse accessors, morph targets, instances, other files.
 */
export function readGltf(bytes: ArrayBuffer): Triangles {
  const head = new DataView(bytes);
  const isBinary = head.getUint32(0, true) === kMagic;
  const length = isBinary ? head.getUint32(12, true) : bytes.byteLength;
  const json = new TextDecoder().decode(new Uint8Array(bytes, isBinary ? kChunkOfJson : 0, length));
  const document = JSON.parse(json) as Document;
  if (document.extensionsRequired?.some((name) => kCompressions.test(name))) throw new Error('compressed');
  const buffers = document.buffers.map(({ uri }) => (uri === undefined ? new DataView(bytes, kChunkOfJson + length + 8) : embedded(uri)));
  return new Scene(document, buffers).triangles();
}

function embedded(uri: string): DataView {
  const base64 = uri.match(/^data:[^,]*;base64,(.*)$/s)?.[1];
  if (base64 === undefined) throw new Error('data in another file');
  return new DataView(Uint8Array.from(atob(base64), (c) => c.charCodeAt(0)).buffer);
}

class Scene {
  private readonly positions: Float64Array[] = [];
  private readonly corners: Uint32Array[] = [];
  private vertices = 0;

  constructor(private readonly document: Document, private readonly buffers: DataView[]) {}

  triangles(): Triangles {
    const { nodes = [], scenes = [], scene = 0 } = this.document;
    const roots = scenes[scene]?.nodes ?? nodes.map((_, k) => k).filter((k) => !nodes.some((node) => node.children?.includes(k)));
    for (const root of roots) this.add(nodes[root]!, new Matrix4(), 0);
    const joined = <T extends Float64Array | Uint32Array>(parts: T[], all: T): T => {
      let at = 0;
      for (const part of parts) all.set(part, at), (at += part.length);
      return all;
    };
    const length = this.corners.reduce((sum, part) => sum + part.length, 0);
    return { positions: joined(this.positions, new Float64Array(3 * this.vertices)), index: joined(this.corners, new Uint32Array(length)) };
  }

  private add(node: Node, above: Matrix4, depth: number): void {
    if (depth > this.document.nodes!.length) throw new Error('nodes in a circle');
    const own = node.matrix ? new Matrix4().fromArray(node.matrix)
      : new Matrix4().compose(new Vector3(...(node.translation ?? [0, 0, 0])), new Quaternion(...(node.rotation ?? [0, 0, 0, 1])), new Vector3(...(node.scale ?? [1, 1, 1])));
    const matrix = above.clone().multiply(own);
    if (node.mesh !== undefined) {
      if (node.extensions?.EXT_mesh_gpu_instancing) throw new Error('instances');
      // The standard: the transform of the node of a skinned mesh has no effect.
      for (const primitive of this.document.meshes[node.mesh]!.primitives) this.addPrimitive(primitive, node.skin === undefined ? matrix : new Matrix4());
    }
    for (const child of node.children ?? []) this.add(this.document.nodes![child]!, matrix, depth + 1);
  }

  private addPrimitive({ attributes, indices, mode = kTriangles, targets }: Primitive, matrix: Matrix4): void {
    if (mode < kTriangles || attributes['POSITION'] === undefined) return;
    if (targets) throw new Error('morph targets');
    const points = this.numbers(attributes['POSITION']), count = points.length / 3;
    const order = indices === undefined ? Float64Array.from({ length: count }, (_, k) => k) : this.numbers(indices);
    const point = new Vector3();
    for (let v = 0; v < points.length; v += 3) point.fromArray(points, v).applyMatrix4(matrix).toArray(points, v);
    const corners = ordered(order, mode, matrix.determinant() < 0);
    for (let k = 0; k < corners.length; ++k) corners[k]! += this.vertices;
    this.positions.push(points);
    this.corners.push(corners);
    this.vertices += count;
  }

  private numbers(which: number): Float64Array {
    const { bufferView, byteOffset = 0, componentType, count, type, normalized, sparse } = this.document.accessors[which]!;
    if (bufferView === undefined || sparse) throw new Error('sparse');
    const width = type === 'VEC3' ? 3 : 1, size = kSizes[componentType]!;
    const { buffer, byteOffset: start = 0, byteStride = width * size } = this.document.bufferViews[bufferView]!;
    const data = this.buffers[buffer]!, scale = normalized ? kLargest[componentType]! : 1;
    const values = new Float64Array(width * count);
    for (let i = 0; i < count; ++i) {
      for (let k = 0; k < width; ++k) values[width * i + k] = component(data, componentType, start + byteOffset + i * byteStride + k * size) / scale;
    }
    return values;
  }
}

const kSizes: Record<number, number> = { 5120: 1, 5121: 1, 5122: 2, 5123: 2, 5125: 4, 5126: 4 };
const kLargest: Record<number, number> = { 5120: 127, 5121: 255, 5122: 32767, 5123: 65535, 5126: 1 };

function component(data: DataView, type: number, at: number): number {
  switch (type) {
    case 5120: return data.getInt8(at);
    case 5121: return data.getUint8(at);
    case 5122: return data.getInt16(at, true);
    case 5123: return data.getUint16(at, true);
    case 5125: return data.getUint32(at, true);
    default: return data.getFloat32(at, true);
  }
}

/** The corners of the triangles of a list, a strip or a fan; turned round in a mirror. */
function ordered(order: ArrayLike<number>, mode: number, mirrored: boolean): Uint32Array {
  const count = mode === kTriangles ? Math.floor(order.length / 3) : Math.max(0, order.length - 2);
  const corners = new Uint32Array(3 * count);
  for (let t = 0; t < count; ++t) {
    const [a, b, c] = mode === kFan ? [0, t + 1, t + 2] : mode === kStrip ? [t, t + 1 + (t % 2), t + 2 - (t % 2)] : [3 * t, 3 * t + 1, 3 * t + 2];
    corners.set([order[a]!, order[mirrored ? c : b]!, order[mirrored ? b : c]!], 3 * t);
  }
  return corners;
}
