/** How a page brings its world to where the partner's page is. */

import type { Command, WorldState } from "../api/world";
import type { Playing } from "../pair/store";

/** While both play, their times may differ by so much; `step` takes so many ticks at most, so often. */
const NEAR_MS = 300;
const MOST_TICKS = 100;
const MOST_STEPS = 40;
/** A world begins again until such a time at most. */
const LATEST_MS = 600_000;

/** Whether a world stands where the partner's page stands. */
export const isAt = ({ playing, seed, shown_ms: shown, t_ms: now }: WorldState, other: Playing) =>
  !playing && !other.playing && seed === other.seed && (shown ?? now) === other.t_ms;

/** What brings a world that stands at `state` to the partner's moment; `passedMs` ago the partner's page was there. */
export function catchUp(other: Playing, state: WorldState, tickMs: number, passedMs: number): Command[] {
  const { playing, speed, seed } = other;
  const near = playing ? NEAR_MS : 0;
  const wanted = other.t_ms + (playing ? Math.round(passedMs * speed) : 0);
  const late = wanted - state.t_ms;
  const commands: Command[] = [];
  const isBefore = late < -near && (playing || wanted === 0);
  if (seed !== state.seed || isBefore || late > MOST_STEPS * MOST_TICKS * tickMs) {
    commands.push({ do: "reset", seed, until_ms: Math.min(wanted, LATEST_MS) });
  } else if (late > near) {
    for (let ticks = Math.round(late / tickMs); ticks > 0; ticks -= MOST_TICKS) commands.push({ do: "step", ticks: Math.min(ticks, MOST_TICKS) });
  } else if (!playing && late < 0) commands.push({ do: "seek", t_ms: wanted });
  if (playing) commands.push({ do: "play", speed });
  return commands;
}
