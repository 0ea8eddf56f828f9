import type { Triangles } from './read';
import { Weld } from './read';

/** Numbers and words of a text, straight from its bytes. */
export class Cursor {
  at = 0;
  constructor(readonly bytes: Uint8Array) {}

  get ended(): boolean {
    return this.at >= this.bytes.length;
  }
  skipBlanks(): void {
    while (this.at < this.bytes.length && (this.bytes[this.at] === 32 || this.bytes[this.at] === 9)) ++this.at;
  }
  /** Skips blanks, line ends and comments. */
  skipSpace(): void {
    for (; this.at < this.bytes.length; ++this.at) {
      const c = this.bytes[this.at]!;
      if (c === 35) this.skipLine(), --this.at;
      else if (c > 32) return;
    }
  }
  skipLine(): void {
    const end = this.bytes.indexOf(10, this.at);
    this.at = end < 0 ? this.bytes.length : end + 1;
  }
  get atLineEnd(): boolean {
    this.skipBlanks();
    const c = this.bytes[this.at];
    return c === undefined || c === 10 || c === 13 || c === 35;
  }
  word(): string {
    this.skipBlanks();
    const start = this.at;
    while (this.at < this.bytes.length && this.bytes[this.at]! > 32) ++this.at;
    let text = '';
    for (let i = start; i < this.at; ++i) text += String.fromCharCode(this.bytes[i]!);
    return text;
  }
  number(): number {
    this.skipBlanks();
    const { bytes } = this;
    const start = this.at;
    let i = start, sign = 1, digits = 0, scale = 0, seen = 0;
    if (bytes[i] === 45) sign = -1, ++i;
    else if (bytes[i] === 43) ++i;
    let point = false;
    for (; ; ++i) {
      const c = bytes[i];
      if (c === 46 && !point) point = true;
      else if (c !== undefined && c >= 48 && c <= 57) {
        ++seen;
        digits = digits * 10 + (c - 48);
        if (point) --scale;
      } else break;
    }
    const c = bytes[i];
    if (seen > 0 && seen <= 15 && (c === undefined || c <= 32 || c === 47 || c === 44)) {
      this.at = i;
      return sign * (scale === 0 ? digits : digits / 10 ** -scale);
    }
    // Exponents and many digits, the rare case.
    const value = Number.parseFloat(this.word());
    if (Number.isNaN(value)) throw new Error('not a number');
    return value;
  }
}

/** Numbers in an array that grows. */
class Growing<T extends Float64Array | Uint32Array> {
  length = 0;
  constructor(private array: T, private readonly make: (n: number) => T) {}
  push(value: number): void {
    if (this.length === this.array.length) {
      const larger = this.make(2 * this.length);
      larger.set(this.array);
      this.array = larger;
    }
    this.array[this.length++] = value;
  }
  taken(): T {
    return this.array.slice(0, this.length) as T;
  }
}
const doubles = () => new Growing(new Float64Array(4096), (n) => new Float64Array(n));
export const indices = () => new Growing(new Uint32Array(4096), (n) => new Uint32Array(n));

export function readObj(buffer: ArrayBuffer): Triangles {
  const cursor = new Cursor(new Uint8Array(buffer));
  const positions = doubles(), index = indices();
  const corners: number[] = [];
  while (!cursor.ended) {
    cursor.skipBlanks();
    const first = cursor.bytes[cursor.at], second = cursor.bytes[cursor.at + 1];
    const spaced = second === 32 || second === 9;
    if (first === 118 && spaced) {
      ++cursor.at;
      for (let k = 0; k < 3; ++k) positions.push(cursor.number());
    } else if (first === 102 && spaced) {
      ++cursor.at;
      corners.length = 0;
      while (!cursor.atLineEnd) {
        const n = cursor.number();
        while (cursor.at < cursor.bytes.length && cursor.bytes[cursor.at]! > 32) ++cursor.at;
        corners.push(n < 0 ? positions.length / 3 + n : n - 1);
      }
      for (let k = 2; k < corners.length; ++k) {
        index.push(corners[0]!);
        index.push(corners[k - 1]!);
        index.push(corners[k]!);
      }
    }
    cursor.skipLine();
  }
  return { positions: positions.taken(), index: index.taken() };
}

export function readOff(buffer: ArrayBuffer): Triangles {
  const cursor = new Cursor(new Uint8Array(buffer));
  cursor.skipSpace();
  cursor.word();
  cursor.skipSpace();
  const vertices = cursor.number(), faces = cursor.number();
  cursor.skipLine();
  const positions = new Float64Array(3 * vertices);
  for (let v = 0; v < vertices; ++v) {
    cursor.skipSpace();
    for (let k = 0; k < 3; ++k) positions[3 * v + k] = cursor.number();
    cursor.skipLine();
  }
  const index = indices();
  for (let f = 0; f < faces; ++f) {
    cursor.skipSpace();
    const count = cursor.number();
    const first = cursor.number();
    let last = cursor.number();
    for (let k = 2; k < count; ++k) {
      const next = cursor.number();
      index.push(first);
      index.push(last);
      index.push(next);
      last = next;
    }
    cursor.skipLine();
  }
  return { positions, index: index.taken() };
}

export function readStlText(buffer: ArrayBuffer): Triangles {
  const cursor = new Cursor(new Uint8Array(buffer));
  const weld = new Weld(0);
  while (!cursor.ended) {
    if (cursor.word() === 'vertex') weld.add(cursor.number(), cursor.number(), cursor.number());
    else if (cursor.atLineEnd) cursor.skipLine();
  }
  return weld.triangles();
}
