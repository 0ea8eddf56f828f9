import { Client, CreasedError } from 'creased-client';
import { askForKey } from './ui/dialogs';

const kName = 'creased-key';

/** The key, which is kept until the tab is closed. */
export const storedKey = (): string | undefined => sessionStorage.getItem(kName) ?? undefined;
const storeKey = (key: string): void => sessionStorage.setItem(kName, key);

/** The service that this page comes from. */
export const clientWith = (links: string[]): Client => new Client({ key: storedKey, links });

/** Does something with the service, and asks for a key as long as it wants one. Throws what else goes wrong. */
export async function withKey<T>(work: () => Promise<T>): Promise<T> {
  for (let wrong = false; ; wrong = true) {
    try {
      return await work();
    } catch (error) {
      const wantsKey = error instanceof CreasedError && error.code === 'unauthorized';
      const key = wantsKey ? await askForKey(wrong || storedKey() !== undefined) : undefined;
      if (!key) throw error;
      storeKey(key);
    }
  }
}
