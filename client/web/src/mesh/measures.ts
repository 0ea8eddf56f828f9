import type { EdgeLabels } from 'creased-client';
import type { Measure } from '../ui/look';
import type { Surface } from './surface';

export interface Comparison {
  measured?: Surface;
  labels?: EdgeLabels;
  /** Mean length of the edges of the upload. */
  edgeLength: number;
  /** The result that this one is compared with; undefined where that is of another mesh. */
  other?: Surface | undefined;
  /** Makes the job once more with the uncertainty of its vertices; undefined where its method has none. */
  askForUncertainty?: () => void;
}

/** How far each vertex moved along its normal, in mean edge lengths; outward is positive. */
function along(from: Surface, to: Surface, edgeLength: number): Float32Array | undefined {
  if (from.source === undefined || to.source === undefined) return undefined;
  const vertices = 1 + to.source.reduce((most, v) => Math.max(most, v), 0);
  if (from.positions.length < 3 * vertices) return undefined;
  const values = new Float32Array(to.positions.length / 3);
  const shift = to.origin.map((x, k) => x - from.origin[k]!);
  for (let v = 0; v < values.length; ++v) {
    const s = 3 * to.source[v]!;
    let sum = 0;
    for (let k = 0; k < 3; ++k) sum += (to.positions[3 * v + k]! + shift[k]! - from.positions[s + k]!) * to.normals[3 * v + k]!;
    values[v] = sum / edgeLength;
  }
  return values;
}

/** Change of the normal along the edges, per length: positive where the surface bends outward. */
function curvature(surface: Surface, edgeLength: number): Float32Array {
  const { positions, normals, index } = surface;
  const sum = new Float32Array(positions.length / 3), weight = new Float32Array(sum.length);
  for (let f = 0; f < index.length; f += 3) {
    for (let k = 0; k < 3; ++k) {
      const a = index[f + k]!, b = index[f + ((k + 1) % 3)]!;
      let bend = 0, length = 0;
      for (let c = 0; c < 3; ++c) {
        const step = positions[3 * b + c]! - positions[3 * a + c]!;
        bend += (normals[3 * b + c]! - normals[3 * a + c]!) * step;
        length += step * step;
      }
      if (length === 0) continue;
      for (const v of [a, b]) {
        sum[v]! += bend;
        weight[v]! += length;
      }
    }
  }
  return sum.map((x, v) => (weight[v]! > 0 ? (x / weight[v]!) * edgeLength : 0));
}

/** How undecided the most undecided edge at each vertex is: 0 for labels of 0 or 1, 1 for one half. */
function doubt(surface: Surface, labels: EdgeLabels): Float32Array {
  const perVertex = new Float32Array(surface.positions.length / 3);
  for (let e = 0; e < labels.labels.length; ++e) {
    const doubt = 1 - Math.abs(2 * labels.labels[e]! - 1);
    for (const v of [labels.edges[2 * e]!, labels.edges[2 * e + 1]!]) perVertex[v] = Math.max(perVertex[v]!, doubt);
  }
  return Float32Array.from(perVertex, (_, v) => perVertex[surface.source?.[v] ?? v]!);
}

/** What a result can be coloured by. */
export function measuresOf(of: Comparison): Measure[] {
  const { measured, labels, edgeLength, other, askForUncertainty } = of;
  const measures: Measure[] = [];
  if (measured) {
    measures.push({ name: 'displacement', unit: 'edge lengths along the normal', scale: 'diverging',
      meaning: 'How far each point moved from where it was measured. Blue is inward, red outward.',
      values: (surface) => along(measured, surface, edgeLength) });
  }
  if ('other' in of) {
    measures.push({ name: 'difference', unit: 'edge lengths along the normal', scale: 'diverging',
      meaning: 'How far this result is from the one it is compared with.',
      values: (surface) => other && along(other, surface, edgeLength), missing: { words: 'The two jobs are of different meshes.' } });
  }
  measures.push({ name: 'curvature', unit: 'radians per edge length', scale: 'diverging',
    meaning: 'How the surface bends. Blue is hollow, red bulges.', values: (surface) => curvature(surface, edgeLength) });
  measures.push({ name: 'ridge label', unit: 'probability', scale: 'sequential',
    meaning: 'The largest label of the edges at each vertex.', values: (surface) => surface.label });
  if (labels) {
    measures.push({ name: 'doubt', unit: '0 decided, 1 undecided', scale: 'sequential',
      meaning: 'Where it is open whether an edge is a ridge.', values: (surface) => doubt(surface, labels) });
  }
  measures.push({ name: 'uncertainty', unit: 'edge lengths, standard deviation', scale: 'sequential',
    meaning: 'How far each point may still be off along the normal.',
    values: (surface) => surface.sigma?.map((x) => x / edgeLength),
    ...(askForUncertainty ? { missing: { words: 'This job was made without it.', remedy: 'Smooth again with uncertainty', act: askForUncertainty } } : {}) });
  measures.push({ name: 'class', unit: '0 smooth, 1 ridge, 2 corner', scale: 'classes',
    meaning: 'What each vertex is: on a smooth part, on a ridge, or a corner.', values: (surface) => surface.vertexClass });
  measures.push({ name: 'segment', unit: 'number of the segment', scale: 'classes',
    meaning: 'Smooth parts that ridges bound.', values: (surface) => surface.segment });
  return measures;
}
