/** The label and the signed dihedral angle of every edge, edge by edge. */
export interface EdgeLabels {
  /** Two vertices for each edge. */
  edges: Uint32Array;
  /** In [0, 1]. */
  labels: Float64Array;
  dihedralDeg: Float64Array;
  count: number;
}

/** Decodes crease.v1.EdgeLabels, which has packed lists only. */
export function decodeLabels(bytes: Uint8Array): EdgeLabels {
  const result: EdgeLabels = {
    edges: new Uint32Array(0),
    labels: new Float64Array(0),
    dihedralDeg: new Float64Array(0),
    count: 0,
  };
  let at = 0;
  const varint = (): number => {
    let value = 0;
    for (let factor = 1; ; factor *= 128) {
      const byte = bytes[at++];
      if (byte === undefined) throw new Error('the labels are cut short');
      value += (byte & 127) * factor;
      if (byte < 128) return value;
    }
  };
  while (at < bytes.length) {
    const tag = varint();
    const field = tag >>> 3;
    if ((tag & 7) === 1) at += 8;
    else if ((tag & 7) === 0) {
      const value = varint();
      if (field === 4) result.count = value;
    } else if ((tag & 7) === 2) {
      const length = varint();
      const end = at + length;
      if (end > bytes.length) throw new Error('the labels are cut short');
      if (field === 1) {
        const edges: number[] | Uint32Array = new Uint32Array(length);
        let count = 0;
        while (at < end) edges[count++] = varint();
        result.edges = edges.slice(0, count);
      } else if (field === 2) result.labels = doubles(bytes, at, length);
      else if (field === 3) result.dihedralDeg = doubles(bytes, at, length);
      at = end;
    } else throw new Error('the labels are not in the expected form');
  }
  return result;
}

function doubles(bytes: Uint8Array, at: number, length: number): Float64Array {
  const copy = bytes.slice(at, at + length);
  return new Float64Array(copy.buffer, 0, length / 8);
}
