import type { Client } from 'creased-client';
import { readInWorker } from './mesh/reader';
import type { Surface } from './mesh/surface';

// Snapshots of large meshes take processor time from the job itself, so a slow one is followed by a long pause.
const kLeastPauseMs = 1000, kPausesPerSnapshot = 8;

/** Shows what a running job has made so far, again and again, until `signal` or `stop`. */
export class Snapshots {
  private stopped = false;

  constructor(
    private readonly client: Client,
    private readonly id: string,
    private readonly signal: AbortSignal,
    private readonly show: (surface: Surface) => void,
  ) {
    void this.run();
  }

  stop(): void {
    this.stopped = true;
  }

  private get over(): boolean {
    return this.stopped || this.signal.aborted;
  }

  private async run(): Promise<void> {
    for (let took = 0; ; ) {
      await new Promise((resolve) => setTimeout(resolve, Math.max(kLeastPauseMs, kPausesPerSnapshot * took)));
      if (this.over) return;
      const began = performance.now();
      try {
        const bytes = await this.client.mesh(this.id, { format: 'glb', snapshot: true }, { signal: this.signal });
        const surface = await readInWorker(bytes, '', true);
        if (!this.over) this.show(surface);
      } catch {
        // There is none yet, or the job has just ended.
      }
      took = performance.now() - began;
    }
  }
}
