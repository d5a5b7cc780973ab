/** A part of the past, played again. */

import { TO_PLAY } from "./play";
import { session } from "./session";
import { useMat } from "./store";

/** The past is stored every so many ms. */
const STORED_EVERY_MS = 100;

let timer: ReturnType<typeof setInterval> | undefined;

/** Show the past from one time to another as it went, until the cars drive again or begin anew. */
export function replay(fromMs: number, untilMs: number): void {
  clearInterval(timer);
  let tMs = Math.max(0, fromMs);
  session.send({ do: "seek", t_ms: tMs });
  timer = setInterval(() => {
    const { state, play } = useMat.getState();
    tMs = Math.min(tMs + STORED_EVERY_MS, untilMs);
    const isGone = TO_PLAY.has(play) || !state || state.t_ms < tMs;
    if (isGone || tMs === untilMs) clearInterval(timer);
    if (!isGone) session.send({ do: "seek", t_ms: tMs });
  }, STORED_EVERY_MS);
}
