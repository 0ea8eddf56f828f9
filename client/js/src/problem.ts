import type { components } from './schema.js';

/** A problem document (RFC 9457). */
export type Problem = components['schemas']['Problem'];

/** A refusal by the service, or a connection that failed. */
export class CreasedError extends Error {
  override readonly name = 'CreasedError';

  constructor(
    message: string,
    /** The status of the answer; 0 when there was none. */
    readonly status: number,
    /** What the service said; undefined when there was no answer, or one from something else. */
    readonly problem?: Problem,
    /** Seconds to wait before trying again, where the service said so. */
    readonly retryAfter?: number,
  ) {
    super(message);
  }

  /** The stable code of the problem; `connection_failed` without an answer. */
  get code(): string {
    return this.problem?.code ?? (this.status === 0 ? 'connection_failed' : 'unknown');
  }
}

/** The error that an answer stands for. */
export function errorOf(status: number, body: string, retryAfter?: string | null): CreasedError {
  let problem: Problem | undefined;
  try {
    const parsed: unknown = JSON.parse(body);
    if (typeof parsed === 'object' && parsed !== null && 'code' in parsed) problem = parsed as Problem;
  } catch {
    // Not a problem document: something between here and the service has answered.
  }
  const seconds = retryAfter ? Number(retryAfter) : NaN;
  const message = problem?.detail || problem?.title || `the service answered with status ${status}`;
  return new CreasedError(message, status, problem, Number.isFinite(seconds) ? seconds : undefined);
}
