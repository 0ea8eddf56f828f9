/** What the address of the page names: a job, and one that it is compared with. */
export interface Place {
  job: string;
  with?: string;
}

const kId = /^[0-9a-f-]{1,64}$/;

export function placeOf(hash: string): Place | undefined {
  const fields = new URLSearchParams(hash.replace(/^#/, ''));
  const job = fields.get('job') ?? '', other = fields.get('with') ?? '';
  if (!kId.test(job)) return undefined;
  return { job, ...(kId.test(other) ? { with: other } : {}) };
}

export const hashOf = (place: Place): string => `#job=${place.job}${place.with ? `&with=${place.with}` : ''}`;
