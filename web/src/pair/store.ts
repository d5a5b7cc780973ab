/** One project, two windows: who programs the leader and who the followers. */

import { create } from "zustand";
import type { EditorName, Project } from "../api/types";
import type { Conducted, PairProject, PairView } from "../generated/classroom";
import { keep } from "../state/storage";

/** How the worlds of both pages are played. */
export type Playing = Omit<Conducted, "number" | "by">;

/** What shares the windows: a class's server, or the tabs of this browser. Each may throw RefusedError or UnreachableError. */
export interface SharedWindows {
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
  shared: SharedWindows | null;
}

export const usePair = create<PairState>(() => ({ view: null, me: "", shared: null }));

/** Whether a window is another's, or nobody's, so that this page only shows it. */
export const isForeign = ({ view, me }: PairState, window: EditorName) => view?.joined === true && view.owners[window] !== me;

export const TAB_KEY = "motorcade.pair";
export const MARK = "#pair=";

/** Whether this page was opened to share the project of another tab. */
export const comesToPair = () => location.hash.startsWith(MARK);

export function rememberPair(id: string | null): void {
  if (id === null) sessionStorage.removeItem(TAB_KEY);
  else keep("sessionStorage", TAB_KEY, id);
}

export const addressOf = (id: string) => location.pathname + MARK + id;
