/** One project, two windows: who programs the leader and who the followers. What shares the windows is loaded only where somebody does. */

import { create } from "zustand";
import type { EditorName, Project } from "../api/types";
import type { Conducted, PairProject, PairView } from "../generated/classroom";
import type { Session } from "../mat/session";

/** How the worlds of both pages are played. */
export type Playing = Omit<Conducted, "number" | "by">;

/** What shares the windows: a class's server, or the tabs of this browser. Each may throw RefusedError or UnreachableError. */
export interface Shared {
  read(window: EditorName): Promise<PairProject>;
  /** Store a window of one's own that was made from version `base`; its new version. */
  write(window: EditorName, project: Project, base: number): Promise<number>;
  take(window: EditorName, wants: boolean): Promise<unknown>;
  swap(wants: boolean): Promise<unknown>;
  join(): Promise<unknown>;
  /** The name of the copy that was stored in the library; "" where none was. */
  leave(): Promise<string>;
  conduct(playing: Playing): Promise<unknown>;
}

interface PairState {
  view: PairView | null;
  /** What `PairView.owners` calls this page's user. */
  me: string;
  shared: Shared | null;
}

export const usePair = create<PairState>(() => ({ view: null, me: "", shared: null }));

/** Whether a window is another's, or nobody's, so that this page only shows it. */
export const isForeign = ({ view, me }: PairState, window: EditorName) => view?.joined === true && view.owners[window] !== me;

const TAB_KEY = "motorcade.pair";
const MARK = "#pair=";

/** The pair of this tab, by its address or from before a reload; null for none. */
export function pairOfTab(): string | null {
  const id = location.hash.startsWith(MARK) ? location.hash.slice(MARK.length) : sessionStorage.getItem(TAB_KEY);
  return id !== null && /^[0-9a-f]{32}$/.test(id) ? id : null;
}

export function rememberPair(id: string | null): void {
  if (id === null) sessionStorage.removeItem(TAB_KEY);
  else sessionStorage.setItem(TAB_KEY, id);
}

export const addressOf = (id: string) => location.pathname + MARK + id;

let own: Session | null = null;

/** The world of this page. */
export const ownSession = () => own;

/** The editors are there: go on with the pair of this tab, if it is in one. */
export function startPairs(session: Session): void {
  own = session;
  const id = pairOfTab();
  if (id === null) return;
  const isNew = location.hash !== "";
  if (isNew) history.replaceState(null, "", location.pathname + location.search);
  void import("./tabs").then(({ comeIn }) => comeIn(id, isNew));
}

/** Take what the class's server tells of this pupil's pair. */
export function receivePair(view: PairView | null, me: string, shared: Shared): void {
  if (view || usePair.getState().view) void import("./follow").then(({ receive }) => receive(view, me, shared));
}
