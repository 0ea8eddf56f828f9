import { readEvents } from './events.js';
import { decodeLabels, type EdgeLabels } from './labels.js';
import { CreasedError, errorOf } from './problem.js';
import type { components, operations } from './schema.js';
import { upload, type Upload } from './upload.js';

type Schemas = components['schemas'];
export type Job = Schemas['Job'];
export type JobState = Job['state'];
export type JobList = Schemas['JobList'];
export type Link = Schemas['Link'];
export type LinkQuery = NonNullable<operations['create_link']['parameters']['query']>;
export type Parameters = Schemas['Parameters'];
export type Progress = Schemas['Progress'];
export type Report = Schemas['Report'];
export type RidgeLines = Schemas['RidgeLines'];
export type MeshFormat = NonNullable<NonNullable<operations['get_mesh']['parameters']['query']>['format']>;

/** What happens to a job: progress, then its end. In between the connection may be lost, and found again. */
export type JobEvent = { type: 'progress'; progress: Progress } | { type: 'lost' } | { type: 'ended'; job: Job };

export interface ClientOptions {
  /** Where the service is, with any path prefix. In a page, the page's own address by default. */
  baseUrl?: string | URL;
  /** The key, or a function that returns the current one. */
  key?: string | (() => string | undefined);
  /** Links made by `link`. A call that asks for what one of them reads uses it, without the key. */
  links?: readonly string[];
  /** By default the global fetch. */
  fetch?: typeof globalThis.fetch;
}

export interface SubmitOptions {
  /** File name of the mesh: shown in lists, and its extension tells the format. */
  name?: string;
  parameters?: Parameters;
  /** Weights of the likelihood, one per vertex. */
  weights?: ArrayLike<number>;
  /** Makes a retry safe. */
  idempotencyKey?: string;
  /** Bytes sent so far, and all. */
  onProgress?: (sent: number, total: number) => void;
  signal?: AbortSignal;
}

export interface Asking {
  signal?: AbortSignal;
}

type Query = Record<string, string | number | boolean | undefined>;

const kRetryMs = 700;

/** A service. Every method throws CreasedError. */
export class Client {
  private readonly base: URL;
  private readonly options: ClientOptions;
  /** By the address without signature. */
  private readonly links = new Map<string, string>();

  constructor(options: ClientOptions = {}) {
    const here = typeof document === 'undefined' ? 'http://127.0.0.1:8080/' : document.baseURI;
    this.base = new URL(options.baseUrl ?? here, here);
    if (!this.base.pathname.endsWith('/')) this.base.pathname += '/';
    this.base.search = this.base.hash = '';
    this.options = options;
    for (const link of options.links ?? []) {
      const url = new URL(link, this.base);
      const signed = url.href;
      for (const field of ['expires', 'key', 'signature']) url.searchParams.delete(field);
      this.links.set(url.href, signed);
    }
  }

  /** The full address of a path of the service. */
  url(path: string, query: Query = {}): string {
    const url = new URL(path.replace(/^\//, ''), this.base);
    for (const [name, value] of Object.entries(query)) {
      if (value !== undefined) url.searchParams.set(name, String(value));
    }
    return url.href;
  }

  /** Submits a mesh. */
  async submit(mesh: Blob | ArrayBuffer | Uint8Array, options: SubmitOptions = {}): Promise<Job> {
    const form = new FormData();
    const blob = mesh instanceof Blob ? mesh : new Blob([mesh as BlobPart]);
    form.append('mesh', blob, options.name ?? 'mesh');
    form.append('parameters', JSON.stringify(options.parameters ?? {}));
    if (options.weights) form.append('weights', JSON.stringify(Array.from(options.weights)));
    const headers = this.headers();
    if (options.idempotencyKey) headers.set('Idempotency-Key', options.idempotencyKey);
    const sending: Upload = { url: this.url('v1/jobs'), form, headers, fetch: this.fetch };
    if (options.onProgress) sending.onProgress = options.onProgress;
    if (options.signal) sending.signal = options.signal;
    return JSON.parse(await upload(sending)) as Job;
  }

  async job(id: string, asking: Asking = {}): Promise<Job> {
    return this.json(this.jobPath(id), asking);
  }

  async jobs(query: { state?: JobState; limit?: number; cursor?: string } = {}, asking: Asking = {}): Promise<JobList> {
    return this.json(this.url('v1/jobs', query), asking);
  }

  async cancel(id: string): Promise<Job> {
    return (await this.call(this.jobPath(id, '/cancel'), { method: 'POST' })).json() as Promise<Job>;
  }

  async remove(id: string): Promise<void> {
    await this.call(this.jobPath(id), { method: 'DELETE' });
  }

  /**
   * Follows a job to its end. Comes back by itself after a lost connection or a restart of the service; the error is
   * thrown when the service says that there is no such job, or that the key is not valid.
   */
  async *follow(id: string, asking: Asking = {}): AsyncGenerator<JobEvent> {
    let last = '';
    for (;;) {
      try {
        const headers: Record<string, string> = { Accept: 'text/event-stream' };
        if (last) headers['Last-Event-ID'] = last;
        const response = await this.call(this.jobPath(id, '/events'), { headers, ...asking });
        if (response.status === 204) {
          yield { type: 'ended', job: await this.job(id, asking) };
          return;
        }
        for await (const event of readEvents(response.body ?? new ReadableStream())) {
          last = event.id;
          if (event.type === 'progress') yield { type: 'progress', progress: JSON.parse(event.data) as Progress };
          else {
            yield { type: 'ended', job: JSON.parse(event.data) as Job };
            return;
          }
        }
      } catch (error) {
        if (asking.signal?.aborted) throw error;
        const passing = error instanceof CreasedError && (error.status === 0 || error.status >= 500 || error.status === 429);
        if (!passing && error instanceof CreasedError) throw error;
      }
      yield { type: 'lost' };
      await pause(kRetryMs, asking.signal);
    }
  }

  /** The smoothed mesh, or what there is of it while the job runs, or the measured positions. */
  async mesh(
    id: string,
    query: { format?: MeshFormat; snapshot?: boolean; measured?: boolean } = {},
    asking: Asking = {},
  ): Promise<ArrayBuffer> {
    const { format = 'glb', ...rest } = query;
    return (await this.call(this.jobPath(id, `/mesh.${format}`, rest), asking)).arrayBuffer();
  }

  /** Labels and dihedral angles of the edges with a label of at least `min`. */
  async labels(id: string, query: { min?: number } = {}, asking: Asking = {}): Promise<EdgeLabels> {
    const response = await this.call(this.jobPath(id, '/labels.pb', query), asking);
    return decodeLabels(new Uint8Array(await response.arrayBuffer()));
  }

  async ridges(id: string, asking: Asking = {}): Promise<RidgeLines> {
    return this.json(this.jobPath(id, '/ridges.json'), asking);
  }

  async report(id: string, asking: Asking = {}): Promise<Report> {
    return this.json(this.jobPath(id, '/report'), asking);
  }

  /** A link to one part of a job, which works without a key until it expires. Its address is complete. */
  async link(id: string, query: LinkQuery, asking: Asking = {}): Promise<Link> {
    const response = await this.call(this.jobPath(id, '/links', query), { method: 'POST', ...asking });
    const { url, ...rest } = (await response.json()) as Link;
    return { ...rest, url: new URL(url, this.base).href };
  }

  /** JSON Schema of the parameters. */
  async parameters(asking: Asking = {}): Promise<unknown> {
    return this.json(this.url('v1/parameters'), asking);
  }

  /** A mesh to try: `part.ply` or `scan.ply`. */
  async sample(name: string, asking: Asking = {}): Promise<ArrayBuffer> {
    return (await this.call(this.url(`v1/samples/${encodeURIComponent(name)}`), asking)).arrayBuffer();
  }

  /** Any file of the service, such as `v1/jobs/…/mesh.obj`, under the name that the service gives it. */
  async file(path: string, asking: Asking = {}): Promise<File> {
    const response = await this.call(this.url(path), asking);
    return new File([await response.blob()], fileName(response.headers.get('Content-Disposition') ?? '') ?? path.split('/').pop()!);
  }

  private get fetch(): typeof globalThis.fetch {
    return this.options.fetch ?? globalThis.fetch.bind(globalThis);
  }

  private jobPath(id: string, rest = '', query: Query = {}): string {
    return this.url(`v1/jobs/${encodeURIComponent(id)}${rest}`, query);
  }

  private headers(more: Record<string, string> = {}): Headers {
    const headers = new Headers(more);
    const key = typeof this.options.key === 'function' ? this.options.key() : this.options.key;
    if (key) headers.set('Authorization', `Bearer ${key}`);
    return headers;
  }

  private async json<T>(url: string, asking: Asking): Promise<T> {
    return (await this.call(url, asking)).json() as Promise<T>;
  }

  private async call(
    url: string,
    init: { method?: string; headers?: Record<string, string>; signal?: AbortSignal } = {},
  ): Promise<Response> {
    let response: Response;
    try {
      const link = this.links.get(url);
      const headers = link ? new Headers(init.headers) : this.headers(init.headers);
      response = await this.fetch(link ?? url, { ...init, headers });
    } catch (error) {
      if (init.signal?.aborted) throw error;
      throw new CreasedError('the service cannot be reached', 0);
    }
    if (!response.ok) throw errorOf(response.status, await response.text(), response.headers.get('Retry-After'));
    return response;
  }
}

/** The file name of a Content-Disposition header. */
function fileName(disposition: string): string | undefined {
  const encoded = disposition.match(/filename\*=UTF-8''([^;]+)/i)?.[1];
  return encoded ? decodeURIComponent(encoded) : disposition.match(/filename="([^"]*)"/i)?.[1];
}

function pause(ms: number, signal?: AbortSignal): Promise<void> {
  return new Promise((resolve, reject) => {
    const timer = setTimeout(resolve, ms);
    signal?.addEventListener('abort', () => {
      clearTimeout(timer);
      reject(signal.reason as Error);
    });
  });
}
