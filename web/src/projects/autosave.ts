/**
 * Keep the work in this browser's own storage, so that it survives a crash of the browser or the server.
 *
 * Each tab has a place of its own there. A new page takes the place of before a reload, or what a closed or crashed tab
 * left behind, unless a tab that is open holds it. Nothing tells for certain that no tab does: one may sleep. So whoever
 * takes a place marks it, and a page that finds another's mark at its place goes on at a new one, with all of its work.
 */

import { uniqueName } from "../api/worldConnection";
import type { OpenedProject, WorkspaceState } from "../api/types";
import { say } from "../i18n";
import { notify } from "../state/dialogs";
import { heldByOthers, own, PLACE_KEY } from "../state/otherTabs";
import { isObject } from "../state/settings";
import { keep } from "../state/storage";
import { type Studio, useStudio } from "../state/studio";
import { endAll, listen } from "../ui/areas";
import { Keeper, type Place } from "./keeper";
import { sameProject } from "./project";

const PREFIX = "motorcade.autosave.";
/** Pupils who use one device one after the other don't find each other's work there. */
const prefixOf = (owner: string) => (owner ? `motorcade.class.${owner}.` : PREFIX);
/** This page's mark. */
const PAGE = uniqueName();

export interface StoredWork extends OpenedProject {
  parkedFollowers: WorkspaceState | null;
  unsaved: boolean;
  /** Whether a file or the library held it; older work does not say. */
  stored?: boolean;
  /** Whether it is what a first visit finds, as nobody has changed it. */
  isOpening?: boolean;
  /** As in `Studio`; work of before missions kept anything does not say. */
  kept?: Studio["kept"];
  attempts?: Studio["attempts"];
  /** When it was stored, in milliseconds, and the mark of the page that did. */
  at: number;
  page?: string;
}

const COLLECT_MS = 400;

export function workOf(studio: Studio, at: number): StoredWork {
  const { name, leader, followers, parkedFollowers, profile, python, mat, rangeMm, car, mission, kept, attempts, unsaved, stored, base } = studio;
  const isOpening = studio.isOpening && !unsaved && !stored;
  const version = base?.name === name.trim() ? base.version : undefined;
  const project = { name, version, leader, followers, parkedFollowers, profile, python, mat, range_mm: rangeMm, car, mission };
  return { ...project, kept, attempts, unsaved, stored, isOpening, at };
}

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
    [stored.mat ?? {}, stored.attempts ?? {}, stored.kept ?? {}, stored.parkedFollowers ?? {}].every(isObject) &&
    typeof (stored.name ?? "") === "string" &&
    typeof stored.profile === "string" &&
    typeof stored.at === "number";
  return whole ? (stored as StoredWork) : null;
}

const workAt = (key: string) => parseWork(localStorage.getItem(key));

/** The places in the browser's storage whose names begin so, that of the newest work first. */
function placesOf(prefix: string): string[] {
  const places = Object.keys(localStorage).filter((key) => key.startsWith(prefix));
  return places.sort((one, other) => (workAt(other)?.at ?? 0) - (workAt(one)?.at ?? 0));
}

/** Whether the newest work is what a first visit finds. */
export const leftOpening = (): boolean => workAt(placesOf(PREFIX)[0] ?? "")?.isOpening ?? false;

/** This tab's place in the browser's storage. */
class Autosave implements Place {
  /** The text that this page left there; null for none. */
  private left: string | null = null;
  private isStored = true;
  private readonly keeper = new Keeper(this, COLLECT_MS, COLLECT_MS);

  /** Hold a place from now on, with what lies there. */
  private take(key: string): void {
    keep("sessionStorage", PLACE_KEY, key);
    own.place = key;
    this.left = localStorage.getItem(key);
    const work = parseWork(this.left);
    const marked = JSON.stringify({ ...work, page: PAGE });
    if (work && keep("localStorage", key, marked)) this.left = marked;
  }

  /** Go on at a new place, where nothing lies. */
  takeNew(prefix = own.place.slice(0, own.place.lastIndexOf(".") + 1)): void {
    this.take(prefix + uniqueName());
  }

  /**
   * Take a place for this tab, and return the work to show first; null where nothing was stored. `owner`: a pupil of a
   * class. Without work of its own, the tab shows what a closed one left behind.
   */
  async find(owner = ""): Promise<StoredWork | null> {
    const prefix = prefixOf(owner);
    const before = sessionStorage.getItem(PLACE_KEY);
    const places = placesOf(prefix);
    let from = before?.startsWith(prefix) ? before : null;
    const others = from !== null || places.length > 0 ? await heldByOthers() : new Set<string>();
    from ??= places.find((key) => !others.has(key)) ?? null;
    const work = from === null ? null : workAt(from);
    // A copy of a tab that is open begins with the same work at a place of its own.
    if (from === null || others.has(from)) this.takeNew(prefix);
    else this.take(from);
    return work;
  }

  concerns(now: Studio, before: Studio): boolean {
    return !sameProject(now, before) || now.unsaved !== before.unsaved || now.mission !== before.mission;
  }

  write(): undefined {
    if (localStorage.getItem(own.place) !== this.left) this.takeNew();
    const text = JSON.stringify({ ...workOf(useStudio.getState(), Date.now()), page: PAGE });
    const isStored = keep("localStorage", own.place, text);
    // Storage in memory takes it all the same.
    this.left = localStorage.getItem(own.place);
    // Files, library and links still work.
    if (this.isStored && !isStored) notify(say("project.notStored"), "warning");
    this.isStored = isStored;
  }

  /** Store every change shortly after it, and at once when the page is left; ask who leaves what can't be stored; returns a function that ends this. */
  start(): () => void {
    const writeAgain = ({ key }: StorageEvent) => {
      if (key !== own.place) return;
      this.keeper.note();
      void this.keeper.keepNow();
    };
    const leave = (event: BeforeUnloadEvent) => {
      void this.keeper.keepNow();
      if (!this.isStored) askUnlessSaved(event);
    };
    // The next visit finds it again, though nobody changes it.
    if (useStudio.getState().isOpening) this.keeper.note();
    return endAll(this.keeper.start(), listen(window, ["storage"], writeAgain), listen(window, ["beforeunload"], leave));
  }
}

/** That of this page. */
export const autosave = new Autosave();

/** Let the browser ask whether to leave, where work would be lost. */
export function askUnlessSaved(event: BeforeUnloadEvent): void {
  const { kept, unsaved } = useStudio.getState();
  if (unsaved || kept?.unsaved) event.preventDefault();
}
