import type { Client } from 'creased-client';
import { readInWorker } from './mesh/reader';
import type { Surface } from './mesh/surface';

const kPauseMs = 1000;

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
    for (;;) {
      await new Promise((resolve) => setTimeout(resolve, kPauseMs));
      if (this.over) return;
      try {
        const bytes = await this.client.mesh(this.id, { format: 'glb', snapshot: true }, { signal: this.signal });
        const surface = await readInWorker(bytes, '', true);
        if (!this.over) this.show(surface);
      } catch {
        // There is none yet, or the job has just ended.
      }
    }
  }
}
