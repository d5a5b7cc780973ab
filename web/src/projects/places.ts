/**
 * Each tab has a place of its own in the browser's storage, which it holds by a lock. What a closed or crashed tab
 * left is taken over by the next one that is opened.
 */

import { uniqueName } from "../api/names";

const PREFIX = "motorcade.autosave.";
/** In this tab's own storage: which place is its own. A reload keeps it, and a copy of the tab has it too. */
const OWN = "motorcade.place";
/** A page that is reloaded lets go of its lock only a moment after the new one has begun. */
const PATIENCE_MS = 700;

export interface Place {
  key: string;
  /** Where what is shown first stands: the own place, that of the tab that this is a copy of, or nowhere yet. */
  from: string | null;
}

/** Whether this tab has the place now, until it is closed. Without locks nobody can know, and all may have it. */
async function hold(key: string, patienceMs = 0): Promise<boolean> {
  const locks = (navigator as Partial<Navigator>).locks;
  if (!locks) return true;
  const wish = patienceMs ? { signal: AbortSignal.timeout(patienceMs) } : { ifAvailable: true };
  return new Promise((resolve) => {
    const held = locks.request(key, wish, (lock) => {
      resolve(lock !== null);
      return lock ? new Promise<never>(() => undefined) : undefined;
    });
    held.catch(() => resolve(false));
  });
}

/** All places that hold something, the newest first; `ageOf` tells from a text when it was kept. */
function placesByAge(ageOf: (text: string) => number): string[] {
  const keys = Object.keys(localStorage).filter((key) => key.startsWith(PREFIX));
  const kept = keys.map((key) => ({ key, at: ageOf(localStorage.getItem(key) ?? "") }));
  return kept.sort((a, b) => b.at - a.at).map(({ key }) => key);
}

async function freePlace(ageOf: (text: string) => number): Promise<string | null> {
  for (const key of placesByAge(ageOf)) if (await hold(key)) return key;
  return null;
}

/** This tab's place: its own of before, else one that nobody has any more, else a new one. */
export async function takePlace(ageOf: (text: string) => number): Promise<Place> {
  const own = sessionStorage.getItem(OWN);
  if (own !== null && (await hold(own, PATIENCE_MS))) return { key: own, from: own };
  const free = own === null ? await freePlace(ageOf) : null;
  const key = free ?? PREFIX + uniqueName();
  if (free === null) await hold(key);
  sessionStorage.setItem(OWN, key);
  return { key, from: free ?? own };
}
