/** What follows the program and the world of a page. */

import type { Session } from "../mat/session";
import { watchStops } from "./stops";
import { trialsOf } from "./trials";

/** Try the program while it runs, and stop the world on what the user has chosen; returns what ends this. */
export function watchCertainty(session: Session): () => void {
  const ends = [watchStops(session), trialsOf(session).watch()];
  return () => {
    for (const end of ends) end();
  };
}
