import type { Triangles } from './read';
import { Cursor } from './read_text';

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

type Source = (type: string) => number;

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
  const next = format === 'ascii' ? textSource(cursor) : binarySource(buffer, cursor.at, format.includes('little'));
  return readElements(elements, next);
}

function textSource(cursor: Cursor): Source {
  return () => {
    cursor.skipSpace();
    return cursor.number();
  };
}

function binarySource(buffer: ArrayBuffer, start: number, little: boolean): Source {
  const data = new DataView(buffer);
  let at = start;
  return (type) => {
    const here = at;
    at += kSizes[type] ?? 4;
    switch (type) {
      case 'char': case 'int8': return data.getInt8(here);
      case 'uchar': case 'uint8': return data.getUint8(here);
      case 'short': case 'int16': return data.getInt16(here, little);
      case 'ushort': case 'uint16': return data.getUint16(here, little);
      case 'int': case 'int32': return data.getInt32(here, little);
      case 'uint': case 'uint32': return data.getUint32(here, little);
      case 'double': case 'float64': return data.getFloat64(here, little);
      default: return data.getFloat32(here, little);
    }
  };
}

function readElements(elements: Element[], next: Source): Triangles {
  let positions = new Float64Array(0);
  const index: number[] = [];
  const corners: number[] = [];
  for (const element of elements) {
    if (element.name === 'vertex') positions = new Float64Array(3 * element.count);
    const slots = element.properties.map((one) => (element.name === 'vertex' ? 'xyz'.indexOf(one.name) : -1));
    for (let i = 0; i < element.count; ++i) {
      element.properties.forEach((property, p) => {
        const slot = property.name.length === 1 ? slots[p]! : -1;
        if (property.length === undefined) {
          const value = next(property.type);
          if (slot >= 0) positions[3 * i + slot] = value;
          return;
        }
        const count = next(property.length);
        corners.length = 0;
        for (let k = 0; k < count; ++k) corners.push(next(property.type));
        if (element.name !== 'face' || !/^vertex_ind/.test(property.name)) return;
        for (let k = 2; k < count; ++k) index.push(corners[0]!, corners[k - 1]!, corners[k]!);
      });
    }
    if (positions.length > 0 && index.length > 0) break;
  }
  return { positions, index: Uint32Array.from(index) };
}
