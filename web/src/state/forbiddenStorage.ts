/** Where the browser forbids storage, as some schools have it: what the page stores there lasts as long as the page. */

const NAMES = ["localStorage", "sessionStorage"] as const;

/** A store in memory; its keys are its own properties, as those of a browser's store. */
function shortLived(): object {
  const held: Record<string, string> = {};
  return Object.setPrototypeOf(held, {
    getItem: (key: string) => held[key] ?? null,
    setItem: (key: string, value: string) => (held[key] = value),
    removeItem: (key: string) => Reflect.deleteProperty(held, key),
  }) as object;
}

/** Replace the stores that may not be used; returns whether there were any. To be called before anything is stored. */
export function replaceForbiddenStorage(): boolean {
  const forbidden = NAMES.filter((name) => {
    try {
      return typeof window[name] !== "object";
    } catch {
      return true;
    }
  });
  for (const name of forbidden) Object.defineProperty(window, name, { configurable: true, value: shortLived() });
  return forbidden.length > 0;
}
