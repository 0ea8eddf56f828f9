import type { Surface } from './surface';
import type { Answer, Order } from './worker';

let worker: Worker | undefined;
let count = 0;
const waiting = new Map<number, { resolve: (surface: Surface) => void; reject: (error: Error) => void }>();

/** Reads a file in the worker, which takes `bytes` over. `made` says that the service wrote it. */
export function readInWorker(bytes: ArrayBuffer, name: string, made: boolean): Promise<Surface> {
  if (!worker) {
    worker = new Worker(new URL('./worker.ts', import.meta.url), { type: 'module' });
    worker.onmessage = ({ data }: MessageEvent<Answer>) => {
      const one = waiting.get(data.id);
      waiting.delete(data.id);
      if (data.surface) one?.resolve(data.surface);
      else one?.reject(new Error(data.error));
    };
  }
  const id = ++count;
  return new Promise((resolve, reject) => {
    waiting.set(id, { resolve, reject });
    worker!.postMessage({ id, bytes, name, made } satisfies Order, [bytes]);
  });
}
