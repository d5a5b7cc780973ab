/**
 * Keep the work in this browser's own storage, so that it survives a crash of the browser or the server.
 *
 * Each tab has a place of its own there, which it holds by a lock. What a closed or crashed tab left behind is taken
 * over by the next tab that is opened.
 */

import i18next from "i18next";
import { uniqueName } from "../api/world";
import type { OpenedProject, WorkspaceState } from "../api/types";
import { notify } from "../state/dialogs";
import { type Studio, useStudio } from "../state/studio";
import { sameProject } from "./project";

const PREFIX = "motorcade.autosave.";
/** Pupils who use one device one after the other don't find each other's work there. */
const prefixOf = (owner: string) => (owner ? `motorcade.class.${owner}.` : PREFIX);
/** The key of this tab's place, in storage that survives a reload and is copied with the tab. */
const OWN = "motorcade.place";
/** A reloaded page releases its lock only a moment after the new page has started. */
const PATIENCE_MS = 700;

/** Hold a lock until what it resolves to is called; null where another tab has it. `onEnd`: it was given back, or taken. */
export function holdLock(name: string, options: LockOptions, onEnd: () => void = () => undefined): Promise<(() => void) | null> {
  return new Promise((resolve) => {
    const held = navigator.locks.request(name, options, (lock) => {
      if (lock) return new Promise<void>((release) => resolve(release));
      resolve(null);
      return undefined;
    });
    held.then(onEnd, () => {
      resolve(null);
      onEnd();
    });
  });
}

/** To wait so long for a lock; 0: not at all. */
export const patience = (ms: number): LockOptions => (ms ? { signal: AbortSignal.timeout(ms) } : { ifAvailable: true });

/** Take a place until the tab is closed; false where another tab has it. Browsers without locks always succeed. */
const hold = async (key: string, patienceMs = 0) => !("locks" in navigator) || (await holdLock(key, patience(patienceMs))) !== null;

/** The place of the newest work that no tab holds. */
async function freePlace(prefix: string): Promise<string | null> {
  const keys = Object.keys(localStorage).filter((key) => key.startsWith(prefix));
  const stored = keys.map((key) => ({ key, at: parseWork(localStorage.getItem(key))?.at ?? 0 }));
  for (const { key } of stored.sort((a, b) => b.at - a.at)) if (await hold(key)) return key;
  return null;
}

/**
 * This tab's place: its earlier one, else one whose tab is closed (`takesOver`), else a new one. `from` is the place of the
 * work to show first: this tab's own, that of the tab it is a copy of, or null.
 */
async function takePlace(prefix: string, takesOver: boolean): Promise<{ key: string; from: string | null }> {
  const before = sessionStorage.getItem(OWN);
  const own = before?.startsWith(prefix) ? before : null;
  if (own !== null && (await hold(own, PATIENCE_MS))) return { key: own, from: own };
  const free = own === null && takesOver ? await freePlace(prefix) : null;
  const key = free ?? prefix + uniqueName();
  if (free === null) await hold(key);
  sessionStorage.setItem(OWN, key);
  return { key, from: free ?? own };
}

export interface StoredWork extends OpenedProject {
  parkedFollowers: WorkspaceState | null;
  unsaved: boolean;
  /** Whether a file or the library held it; older work does not say. */
  stored?: boolean;
  /** As in `Studio`; work of before missions kept anything does not say. */
  kept?: Studio["kept"];
  attempts?: Studio["attempts"];
  /** When it was stored, in milliseconds. */
  at: number;
}

const COLLECT_MS = 400;

export function workOf(studio: Studio, at: number): StoredWork {
  const { name, leader, followers, parkedFollowers, profile, python, mat, rangeMm, mission, kept, attempts, unsaved, stored, base } = studio;
  const version = base?.name === name.trim() ? base.version : undefined;
  const project = { name, version, leader, followers, parkedFollowers, profile, python, mat, range_mm: rangeMm, mission };
  return { ...project, kept, attempts, unsaved, stored, at };
}

const isObject = (value: unknown): value is Record<string, unknown> =>
  typeof value === "object" && value !== null && !Array.isArray(value);

/** What was stored; null where there is nothing, or nothing that can be understood. */
export function parseWork(text: string | null): StoredWork | null {
  let stored: unknown;
  try {
    stored = JSON.parse(text ?? "null");
  } catch {
    return null;
  }
  const whole =
    isObject(stored) &&
    isObject(stored.leader) &&
    (stored.followers === null || isObject(stored.followers)) &&
    typeof stored.profile === "string" &&
    typeof stored.at === "number";
  return whole ? (stored as StoredWork) : null;
}

/**
 * This tab's place, and what is to be shown first; null where nothing was stored. `owner`: a pupil of a class. `takesOver`:
 * without work of its own, the tab shows what a closed one left behind.
 */
export async function findWork(owner = "", takesOver = true): Promise<{ key: string; stored: StoredWork | null }> {
  const { key, from } = await takePlace(prefixOf(owner), takesOver);
  return { key, stored: from === null ? null : parseWork(localStorage.getItem(from)) };
}

/** Store every change at `key` shortly after it, and at once when the page is left. */
export function storeEveryChange(key: string): void {
  let collecting: ReturnType<typeof setTimeout> | undefined;
  let told = false;
  const store = () => {
    clearTimeout(collecting);
    collecting = undefined;
    try {
      localStorage.setItem(key, JSON.stringify(workOf(useStudio.getState(), Date.now())));
      told = false;
    } catch {
      // The browser's storage is full or forbidden: files, library and links still work.
      if (!told) notify(i18next.t("project.notStored"), "warning");
      told = true;
    }
  };
  useStudio.subscribe((now, before) => {
    if (!sameProject(now, before) || now.unsaved !== before.unsaved || now.mission !== before.mission) collecting ??= setTimeout(store, COLLECT_MS);
  });
  window.addEventListener("pagehide", () => collecting && store());
}
