import { coarsened } from './coarse';
import { readGlb } from './glb';
import { readMesh } from './read';
import type { Surface } from './surface';

/** Reads meshes away from the page's own thread. */
export type Order = { id: number; bytes: ArrayBuffer; name: string; made: boolean };
export type Answer = { id: number; surface?: Surface; error?: string };

self.onmessage = ({ data }: MessageEvent<Order>) => {
  const { id, bytes, name, made } = data;
  try {
    const surface = made ? readGlb(bytes) : readMesh(bytes, name);
    const coarse = coarsened(surface);
    if (coarse) surface.coarse = coarse;
    const buffers = new Set<ArrayBuffer>();
    for (const array of Object.values(surface)) {
      if (ArrayBuffer.isView(array)) buffers.add(array.buffer as ArrayBuffer);
    }
    (self as unknown as Worker).postMessage({ id, surface } satisfies Answer, [...buffers]);
  } catch (error) {
    self.postMessage({ id, error: error instanceof Error ? error.message : String(error) } satisfies Answer);
  }
};
