import type { Client, EdgeLabels, Job, RidgeLines } from 'creased-client';
import { readInWorker } from './mesh/reader';
import type { Surface } from './mesh/surface';

/** A job that has succeeded, with what the page draws of it. */
export interface Outcome {
  job: Job;
  surface: Surface;
  measured?: Surface;
  labels: EdgeLabels;
  ridges?: RidgeLines;
}

/** Whether two jobs are of one mesh, so that their results can be compared vertex by vertex. */
export const sameMesh = ({ job: { input: a } }: Outcome, { job: { input: b } }: Outcome): boolean =>
  a.sha256 === b.sha256 || (a.vertices === b.vertices && a.faces === b.faces && a.edges === b.edges);

// Edges below this are never drawn, and most are.
const kLeastLabel = 0.02;

/** Loads what a job has made. */
export async function loadOutcome(client: Client, job: Job, signal: AbortSignal): Promise<Outcome> {
  const asking = { signal };
  const [result, measured, labels, ridges] = await Promise.all([
    client.mesh(job.id, { format: 'glb' }, asking).then((bytes) => readInWorker(bytes, '', true)),
    client.mesh(job.id, { format: 'glb', measured: true }, asking).then((bytes) => readInWorker(bytes, '', true)).catch(() => undefined),
    client.labels(job.id, { min: kLeastLabel }, asking),
    client.ridges(job.id, asking),
  ]);
  const outcome: Outcome = { job, surface: result, labels, ridges };
  if (measured) {
    // Both have the same faces, which are uploaded and kept once.
    if (measured.index.length === result.index.length) measured.index = result.index;
    outcome.measured = measured;
  }
  return outcome;
}
