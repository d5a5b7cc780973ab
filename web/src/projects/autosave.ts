/**
 * Keep the work in this browser's own storage, so that it survives a crash of the browser or the server.
 *
 * Each tab has a place of its own there, which it holds by a lock. What a closed or crashed tab left behind is taken
 * over by the next tab that is opened.
 */

import { uniqueName } from "../api/names";
import type { OpenedProject, WorkspaceState } from "../api/types";
import { type Studio, useStudio } from "../state/studio";
import { sameProject } from "./project";

const PREFIX = "motorcade.autosave.";
/** In this tab's own storage: which place is its own. A reload keeps it, and a copy of the tab has it too. */
const OWN = "motorcade.place";
/** A page that is reloaded lets go of its lock only a moment after the new one has begun. */
const PATIENCE_MS = 700;

interface Place {
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
async function takePlace(ageOf: (text: string) => number): Promise<Place> {
  const own = sessionStorage.getItem(OWN);
  if (own !== null && (await hold(own, PATIENCE_MS))) return { key: own, from: own };
  const free = own === null ? await freePlace(ageOf) : null;
  const key = free ?? PREFIX + uniqueName();
  if (free === null) await hold(key);
  sessionStorage.setItem(OWN, key);
  return { key, from: free ?? own };
}

export interface Kept extends OpenedProject {
  parkedFollowers: WorkspaceState | null;
  unsaved: boolean;
  /** When it was kept, in milliseconds. */
  at: number;
}

const COLLECT_MS = 400;

export function keptOf(studio: Studio, at: number): Kept {
  const { name, leader, followers, parkedFollowers, profile, mat, rangeMm, unsaved } = studio;
  return { name, leader, followers, parkedFollowers, profile, mat, range_mm: rangeMm, unsaved, at };
}

const isObject = (value: unknown): value is Record<string, unknown> =>
  typeof value === "object" && value !== null && !Array.isArray(value);

/** What was kept; null where there is nothing, or nothing that can be understood. */
export function parseKept(text: string | null): Kept | null {
  let kept: unknown;
  try {
    kept = JSON.parse(text ?? "null");
  } catch {
    return null;
  }
  const whole =
    isObject(kept) &&
    isObject(kept.leader) &&
    (kept.followers === null || isObject(kept.followers)) &&
    typeof kept.profile === "string" &&
    typeof kept.at === "number";
  return whole ? (kept as Kept) : null;
}

/** This tab's place, and what is to be shown first; null where nothing was kept. */
export async function findKept(): Promise<{ key: string; kept: Kept | null }> {
  const { key, from } = await takePlace((text) => parseKept(text)?.at ?? 0);
  return { key, kept: from === null ? null : parseKept(localStorage.getItem(from)) };
}

/** Keeps every change at `key` shortly after it, and at once when the page is left. */
export function keepEveryChange(key: string): void {
  let collecting: ReturnType<typeof setTimeout> | undefined;
  const keep = () => {
    clearTimeout(collecting);
    collecting = undefined;
    try {
      localStorage.setItem(key, JSON.stringify(keptOf(useStudio.getState(), Date.now())));
    } catch {
      // The browser's storage is full or forbidden: files, library and links still work.
    }
  };
  useStudio.subscribe((now, before) => {
    if (!sameProject(now, before) || now.unsaved !== before.unsaved) collecting ??= setTimeout(keep, COLLECT_MS);
  });
  window.addEventListener("pagehide", () => collecting && keep());
}
