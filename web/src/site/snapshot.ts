/**
 * The memory of a Python that has just started, stored in this browser: the next visit begins with it, seconds sooner.
 *
 * Only browsers that have a cache for this page store it: not over plain HTTP from another computer.
 */

const CACHE = "motorcade-python";

/** Whether a snapshot can be stored. */
export const canStore = (): boolean => "caches" in globalThis;

/** The snapshot that was stored under an address; null where there is none. */
export async function storedSnapshot(address: string): Promise<Uint8Array | null> {
  if (!canStore()) return null;
  try {
    const found = await (await caches.open(CACHE)).match(address);
    return found ? new Uint8Array(await found.arrayBuffer()) : null;
  } catch {
    return null;
  }
}

/** Store a snapshot in place of all others; null: store none. Where there is no room, the next visit begins without. */
export async function storeSnapshot(address: string, snapshot: Uint8Array<ArrayBuffer> | null): Promise<void> {
  if (!canStore()) return;
  try {
    await caches.delete(CACHE);
    if (snapshot) await (await caches.open(CACHE)).put(address, new Response(snapshot));
  } catch (error) {
    console.info("No snapshot of Python is stored:", error);
  }
}
