import type { Client, LinkQuery } from 'creased-client';
import { storedKey } from './access';

/** What the address of the page names: a job, one that it is compared with, and signatures that stand for a key. */
export interface Place {
  job: string;
  with?: string;
  share?: Share;
}
interface Share {
  /** Id of the key that made the links. */
  key: string;
  /** Time of expiry and signature of each. */
  signed: { expires: string; signature: string }[];
}

/** What the page reads of a job that has succeeded. A shared address has a signature for each. */
const kShared: LinkQuery[] = [
  { result: 'job' },
  { result: 'mesh', format: 'glb' },
  { result: 'mesh', format: 'glb', measured: true },
  { result: 'labels', format: 'pb', min: 0.02 },
  { result: 'ridges', format: 'json' },
];
const kShareSeconds = 7 * 86_400;
const kId = /^[0-9a-f-]{1,64}$/;

export function placeOf(hash: string): Place | undefined {
  const fields = new URLSearchParams(hash.replace(/^#/, ''));
  const job = fields.get('job') ?? '', other = fields.get('with') ?? '', signed = fields.get('signed');
  if (!kId.test(job)) return undefined;
  const place: Place = { job };
  if (kId.test(other)) place.with = other;
  if (signed) {
    const pairs = signed.split('.').map((pair) => pair.split('-'));
    place.share = { key: fields.get('key') ?? '', signed: pairs.map(([expires = '', signature = '']) => ({ expires, signature })) };
  }
  return place;
}

export const hashOf = (place: Place): string => `#job=${place.job}${place.with ? `&with=${place.with}` : ''}`;

/** The links of a shared address, for the client. */
export function linksOf({ job, share }: Place): string[] {
  if (!share) return [];
  return share.signed.slice(0, kShared.length).map((signed, k) => {
    const { result, format, ...rest } = kShared[k]!;
    const path = `v1/jobs/${job}${result === 'job' ? '' : `/${result}`}${format ? `.${format}` : ''}`;
    const fields = Object.entries({ ...rest, ...(share.key ? { key: share.key } : {}), ...signed });
    return `${path}?${new URLSearchParams(fields.map(([name, value]) => [name, String(value)])).toString()}`;
  });
}

/** The address of a job for others. With a key it has links in place of it, for a week, to all that the page shows. */
export async function addressOf(client: Client, job: string): Promise<{ address: string; words: string }> {
  if (!storedKey()) return { address: location.href, words: '' };
  const links = await Promise.all(kShared.map((query) => client.link(job, { ...query, expires_in: kShareSeconds })));
  const queries = links.map(({ url }) => new URL(url).searchParams);
  const key = queries[0]!.get('key');
  const signed = queries.map((query) => `${query.get('expires')}-${query.get('signature')}`).join('.');
  const address = new URL(`#job=${job}${key ? `&key=${key}` : ''}&signed=${signed}`, location.href).href;
  return { address, words: `It needs no key until ${new Date(links[0]!.expires_at).toLocaleDateString()}.` };
}
