/**
 * What the page keeps in this browser. Some browsers forbid it, as in some schools, or have no room: then what is stored
 * lasts as long as the page, or isn't stored, and whoever stores something learns that from the answer.
 */

const NAMES = ["localStorage", "sessionStorage"] as const;
type AreaName = (typeof NAMES)[number];

/** The stores that last as long as this page. */
const shortLived = new Set<AreaName>();

/** A store in memory; its keys are its own properties, as those of a browser's store. */
function storeInMemory(): object {
  const held: Record<string, string> = {};
  return Object.setPrototypeOf(held, {
    getItem: (key: string) => held[key] ?? null,
    setItem: (key: string, value: string) => (held[key] = value),
    removeItem: (key: string) => Reflect.deleteProperty(held, key),
  }) as object;
}

/** Whether a store is there; one that is full holds something, and can be read. */
function isUsable(name: AreaName): boolean {
  const probe = "motorcade.probe";
  let isEmpty = true;
  try {
    const area = window[name] as Storage | null;
    isEmpty = area === null || Object.keys(area).length === 0;
    area!.setItem(probe, "");
    area!.removeItem(probe);
    return true;
  } catch {
    return !isEmpty;
  }
}

/** Replace the stores that may not be used. To be called before anything is stored. */
export function replaceForbiddenStorage(): void {
  for (const name of NAMES.filter((each) => !isUsable(each))) {
    shortLived.add(name);
    Object.defineProperty(window, name, { configurable: true, value: storeInMemory() });
  }
}

/** Store a text; false where it isn't stored, or is lost with this page. */
export function keep(name: AreaName, key: string, text: string): boolean {
  try {
    window[name].setItem(key, text);
    return !shortLived.has(name);
  } catch {
    return false;
  }
}
