/** The work in this browser's own storage: it outlives a crash of the browser, and of the server. */

import type { OpenedProject, WorkspaceState } from "../api/types";
import { useStudio, type Studio } from "../app/store";
import { takePlace } from "./places";

export interface Kept extends OpenedProject {
  parkedFollowers: WorkspaceState | null;
  unsaved: boolean;
  /** When it was kept, in milliseconds. */
  at: number;
}

const GATHER_MS = 400;

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
  let gathering: ReturnType<typeof setTimeout> | undefined;
  const keep = () => {
    clearTimeout(gathering);
    gathering = undefined;
    try {
      localStorage.setItem(key, JSON.stringify(keptOf(useStudio.getState(), Date.now())));
    } catch {
      // The browser's storage is full or forbidden: files, library and links still work.
    }
  };
  useStudio.subscribe((now, before) => {
    const same =
      now.leader === before.leader &&
      now.followers === before.followers &&
      now.mat === before.mat &&
      now.rangeMm === before.rangeMm &&
      now.name === before.name &&
      now.unsaved === before.unsaved;
    if (!same) gathering ??= setTimeout(keep, GATHER_MS);
  });
  window.addEventListener("pagehide", () => gathering && keep());
}
