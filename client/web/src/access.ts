import { Client } from 'creased-client';

const kName = 'creased-key';

/** The key, which is kept until the tab is closed. */
export const storedKey = (): string | undefined => sessionStorage.getItem(kName) ?? undefined;
export const storeKey = (key: string): void => sessionStorage.setItem(kName, key);

/** The service that this page comes from. */
export const clientWith = (links: string[]): Client => new Client({ key: storedKey, links });
