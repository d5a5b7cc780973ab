/** Begin to share windows; what does it is loaded only where somebody shares them. */

import type { PairView } from "../generated/classroom";
import { comesToPair, MARK, type SharedWindows, TAB_KEY, usePair } from "./store";

/** The pair of this tab, by its address or from before a reload; null for none. */
function pairOfTab(): string | null {
  const id = comesToPair() ? location.hash.slice(MARK.length) : sessionStorage.getItem(TAB_KEY);
  return id !== null && /^[0-9a-f]{32}$/.test(id) ? id : null;
}

/** The editors are there: go on with the pair of this tab, if it is in one. */
export function startPairs(): void {
  const id = pairOfTab();
  if (id === null) return;
  const isNew = location.hash !== "";
  if (isNew) history.replaceState(null, "", location.pathname + location.search);
  void import("./tabs").then(({ comeIn }) => comeIn(id, isNew));
}

/** Take what the class's server tells of this pupil's pair. */
export function receivePair(view: PairView | null, me: string, shared: SharedWindows): void {
  if (view || usePair.getState().view) void import("./follow").then(({ receive }) => receive(view, me, shared));
}
