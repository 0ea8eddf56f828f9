import { smoothNormals, type Surface } from './surface';

/** As glTF has it. */
export interface Accessor {
  bufferView?: number;
  byteOffset?: number;
  componentType: number;
  count: number;
  type: string;
  normalized?: boolean;
  sparse?: unknown;
}
interface Document {
  accessors?: Accessor[];
  bufferViews?: { byteOffset?: number; byteLength: number; byteStride?: number; buffer: number }[];
  buffers?: { uri?: string; byteLength: number }[];
  meshes?: { primitives: { attributes: Record<string, number>; indices?: number; mode?: number }[] }[];
  nodes?: { mesh?: number; translation?: [number, number, number]; children?: number[] }[];
  extensionsRequired?: string[];
}

const kComponents: Record<string, number> = { SCALAR: 1, VEC2: 2, VEC3: 3, VEC4: 4 };
/** The first word of a GLB file. */
export const kMagic = 0x46546c67;

/** The surface of a GLB file. What the service writes is not copied: the arrays are views of `bytes`. */
export function readGlb(bytes: ArrayBuffer): Surface {
  const head = new DataView(bytes);
  if (bytes.byteLength < 20 || head.getUint32(0, true) !== kMagic) throw new Error('not a GLB file');
  const jsonLength = head.getUint32(12, true);
  const document = JSON.parse(new TextDecoder().decode(new Uint8Array(bytes, 20, jsonLength))) as Document;
  const binary = 20 + jsonLength + 8;
  return surfaceOf(document, bytes, binary);
}

function surfaceOf(document: Document, bytes: ArrayBuffer, start: number): Surface {
  if (document.extensionsRequired?.length) throw new Error(`needs ${document.extensionsRequired.join(', ')}`);
  const primitives = document.meshes?.[0]?.primitives ?? [];
  const faces = primitives.find((one) => (one.mode ?? 4) === 4);
  if (!faces) throw new Error('no triangles');
  const floats = (name: string): Float32Array | undefined => {
    const at = faces.attributes[name];
    return at === undefined ? undefined : (view(document, bytes, start, at) as Float32Array);
  };
  const positions = floats('POSITION');
  if (!positions) throw new Error('no positions');
  const parts = primitives.filter((one) => (one.mode ?? 4) === 4 && one.attributes.POSITION === faces.attributes.POSITION);
  const index = joined(
    parts.map((part) =>
      part.indices === undefined
        ? Uint32Array.from({ length: positions.length / 3 }, (_, i) => i)
        : wide(view(document, bytes, start, part.indices)),
    ),
  );
  const origin = document.nodes?.find((node) => node.mesh === 0)?.translation ?? [0, 0, 0];
  const surface: Surface = { positions, index, normals: floats('NORMAL') ?? smoothNormals(positions, index), origin };
  const label = floats('_LABEL'), vertexClass = floats('_CLASS'), segment = floats('_SEGMENT'), sigma = floats('_SIGMA'), source = floats('_SOURCE');
  if (label) surface.label = label;
  if (vertexClass) surface.vertexClass = vertexClass;
  if (segment) surface.segment = segment;
  if (sigma) surface.sigma = sigma;
  if (source) surface.source = source;
  const lines = primitives.find((one) => one.mode === 1 && one.indices !== undefined);
  if (lines) surface.ridges = view(document, bytes, start, lines.indices!) as Uint32Array;
  return surface;
}

function view(document: Document, bytes: ArrayBuffer, start: number, accessor: number) {
  const { bufferView, byteOffset = 0, componentType, count, type } = document.accessors![accessor]!;
  const source = document.bufferViews![bufferView ?? 0]!;
  const length = count * (kComponents[type] ?? 1);
  const at = start + (source.byteOffset ?? 0) + byteOffset;
  const size = componentType === 5126 || componentType === 5125 ? 4 : componentType === 5123 ? 2 : 1;
  if (source.byteStride && source.byteStride !== size * (kComponents[type] ?? 1)) throw new Error('interleaved');
  const aligned = at % size === 0;
  const buffer = aligned ? bytes : bytes.slice(at, at + length * size);
  const offset = aligned ? at : 0;
  if (componentType === 5126) return new Float32Array(buffer, offset, length);
  if (componentType === 5125) return new Uint32Array(buffer, offset, length);
  if (componentType === 5123) return new Uint16Array(buffer, offset, length);
  return new Uint8Array(buffer, offset, length);
}

/** The faces of one surface are in several parts where it has several materials. */
function joined(parts: Uint32Array[]): Uint32Array {
  if (parts.length === 1) return parts[0]!;
  const all = new Uint32Array(parts.reduce((sum, part) => sum + part.length, 0));
  let at = 0;
  for (const part of parts) {
    all.set(part, at);
    at += part.length;
  }
  return all;
}

function wide(indices: ArrayLike<number>): Uint32Array {
  return indices instanceof Uint32Array ? indices : Uint32Array.from(indices);
}
