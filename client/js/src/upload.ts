import { CreasedError, errorOf } from './problem.js';

export interface Upload {
  url: string;
  form: FormData;
  headers: Headers;
  fetch: typeof globalThis.fetch;
  onProgress?: (sent: number, total: number) => void;
  signal?: AbortSignal;
}

/** Posts a form and returns the body of the answer. */
export function upload(sending: Upload): Promise<string> {
  // fetch does not tell how much of a body is sent; browsers' older interface does.
  return sending.onProgress && typeof XMLHttpRequest !== 'undefined' ? byRequest(sending) : byFetch(sending);
}

async function byFetch({ url, form, headers, fetch, signal }: Upload): Promise<string> {
  let response: Response;
  try {
    response = await fetch(url, { method: 'POST', body: form, headers, ...(signal ? { signal } : {}) });
  } catch (error) {
    if (signal?.aborted) throw error;
    throw new CreasedError('the service cannot be reached', 0);
  }
  const body = await response.text();
  if (!response.ok) throw errorOf(response.status, body, response.headers.get('Retry-After'));
  return body;
}

function byRequest({ url, form, headers, onProgress, signal }: Upload): Promise<string> {
  return new Promise((resolve, reject) => {
    const request = new XMLHttpRequest();
    request.open('POST', url);
    headers.forEach((value, name) => request.setRequestHeader(name, value));
    request.upload.onprogress = (event) => onProgress?.(event.loaded, event.total);
    request.onload = () => {
      const good = request.status >= 200 && request.status < 300;
      if (good) resolve(request.responseText);
      else reject(errorOf(request.status, request.responseText, request.getResponseHeader('Retry-After')));
    };
    request.onerror = () => reject(new CreasedError('the service cannot be reached, or ended the upload', 0));
    request.onabort = () => reject(signal?.reason ?? new DOMException('aborted', 'AbortError'));
    signal?.addEventListener('abort', () => request.abort());
    request.send(form);
  });
}
