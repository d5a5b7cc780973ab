/** One project, two windows: who programs the leader and who the followers. A class's server has the windows. */

import { create } from "zustand";
import type { EditorName } from "../api/types";
import type { Conducted, PairView } from "../generated/classroom";

/** How the worlds of both pages are played. */
export type Playing = Omit<Conducted, "number" | "by" | "age_ms">;

interface PairState {
  view: PairView | null;
  /** What `PairView.owners` calls this page's user. */
  me: string;
  /** What stores and follows its windows, while it lasts. */
  pair: { end(): void; write(): Promise<void>; follow(view: PairView, before: PairView): Promise<void> } | null;
}

export const usePair = create<PairState>(() => ({ view: null, me: "", pair: null }));

/** Whether a window is another's, or nobody's, so that this page only shows it. */
export const isForeign = ({ view, me }: PairState, window: EditorName) => view?.joined === true && view.owners[window] !== me;
