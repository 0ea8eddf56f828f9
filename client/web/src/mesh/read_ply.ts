import type { Triangles } from './read';
import { Cursor, indices } from './read_text';

interface Property {
  name: string;
  type: string;
  /** Type of the length of a list. */
  length?: string;
}
interface Element {
  name: string;
  count: number;
  properties: Property[];
}

const kSizes: Record<string, number> = {
  char: 1, uchar: 1, int8: 1, uint8: 1, short: 2, ushort: 2, int16: 2, uint16: 2,
  int: 4, uint: 4, int32: 4, uint32: 4, float: 4, float32: 4, double: 8, float64: 8,
};

/** Reads the next number of the file. */
type Next = () => number;
/** What reads numbers of a type. */
type Source = (type: string) => Next;

export function readPly(buffer: ArrayBuffer): Triangles {
  const bytes = new Uint8Array(buffer);
  const cursor = new Cursor(bytes);
  let format = '';
  const elements: Element[] = [];
  for (;;) {
    if (cursor.ended) throw new Error('no end of the header');
    const word = cursor.word();
    if (word === 'format') format = cursor.word();
    if (word === 'element') elements.push({ name: cursor.word(), count: cursor.number(), properties: [] });
    if (word === 'property') {
      const type = cursor.word();
      const property = type === 'list' ? { length: cursor.word(), type: cursor.word(), name: cursor.word() } : { type, name: cursor.word() };
      elements.at(-1)?.properties.push(property);
    }
    cursor.skipLine();
    if (word === 'end_header') break;
  }
  return readElements(elements, format === 'ascii' ? textSource(cursor) : binarySource(buffer, cursor.at, format.includes('little')));
}

function textSource(cursor: Cursor): Source {
  return () => () => {
    cursor.skipSpace();
    return cursor.number();
  };
}

function binarySource(buffer: ArrayBuffer, start: number, little: boolean): Source {
  const data = new DataView(buffer);
  let at = start;
  const sized = (size: number, get: (at: number) => number): Next => () => {
    const here = at;
    at += size;
    return get(here);
  };
  return (type) => {
    const size = kSizes[type] ?? 4;
    switch (type) {
      case 'char': case 'int8': return sized(size, (here) => data.getInt8(here));
      case 'uchar': case 'uint8': return sized(size, (here) => data.getUint8(here));
      case 'short': case 'int16': return sized(size, (here) => data.getInt16(here, little));
      case 'ushort': case 'uint16': return sized(size, (here) => data.getUint16(here, little));
      case 'int': case 'int32': return sized(size, (here) => data.getInt32(here, little));
      case 'uint': case 'uint32': return sized(size, (here) => data.getUint32(here, little));
      case 'double': case 'float64': return sized(size, (here) => data.getFloat64(here, little));
      default: return sized(size, (here) => data.getFloat32(here, little));
    }
  };
}

function readElements(elements: Element[], source: Source): Triangles {
  let positions = new Float64Array(0);
  const index = indices();
  for (const { name, count, properties } of elements) {
    if (name === 'vertex') positions = new Float64Array(3 * count);
    const readers = properties.map((property) => reader(property, name, source, positions, index));
    for (let i = 0; i < count; ++i) {
      for (const read of readers) read(i);
    }
    if (positions.length > 0 && index.length > 0) break;
  }
  return { positions, index: index.taken() };
}

/** What reads a property of the i-th of its elements, and keeps coordinates and faces. */
function reader(property: Property, element: string, source: Source, positions: Float64Array, index: ReturnType<typeof indices>): (i: number) => void {
  const next = source(property.type);
  const axis = element === 'vertex' && property.name.length === 1 ? 'xyz'.indexOf(property.name) : -1;
  if (property.length === undefined) {
    if (axis < 0) return () => void next();
    return (i) => { positions[3 * i + axis] = next(); };
  }
  const length = source(property.length);
  if (element !== 'face' || !/^vertex_ind/.test(property.name)) {
    return () => { for (let left = length(); left > 0; --left) next(); };
  }
  return () => {
    const count = length();
    const first = count > 0 ? next() : 0;
    let last = count > 1 ? next() : 0;
    for (let k = 2; k < count; ++k) {
      const corner = next();
      index.push(first);
      index.push(last);
      index.push(corner);
      last = corner;
    }
  };
}
