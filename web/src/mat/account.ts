/** What the swarm does, in a sentence for those who don't see it. */

import i18next from "i18next";
import { Flag, type Picture, type WorldState } from "../api/world";

/** The last one is a driver's, whatever the direction. */
const DIRECTIONS = ["forward", "left", "right", "driven"] as const;
type Doing = (typeof DIRECTIONS)[number] | "still";

export interface Sight {
  leaders: Record<Doing, number>;
  followers: Record<Doing, number>;
  lit: number;
}

function doing(wheels: number): Doing {
  return wheels & 3 ? (DIRECTIONS[wheels >> 2] ?? "still") : "still";
}

const nothing = (): Record<Doing, number> => ({ forward: 0, left: 0, right: 0, driven: 0, still: 0 });

export function look(picture: Picture, leads: ReadonlySet<number>): Sight {
  const sight: Sight = { leaders: nothing(), followers: nothing(), lit: 0 };
  for (let k = 0; k < picture.cars; k++) {
    sight[leads.has(k) ? "leaders" : "followers"][doing(picture.wheels[k]!)] += 1;
    if (picture.led[k]! < 4 && picture.flags[k]! & Flag.runs) sight.lit += 1;
  }
  return sight;
}

export function lostOf(counts: WorldState["counts"]): number {
  return Object.entries(counts).reduce((sum, [name, count]) => (name.startsWith("lost_") ? sum + count : sum), 0);
}

/** How many frames were lost in the last seconds of the world's time, from the sums that it tells. */
export class Losses {
  private sums: { tMs: number; lost: number }[] = [];

  constructor(private readonly lastMs: number) {}

  take({ t_ms: tMs, counts }: WorldState): number {
    if (this.sums.length && tMs < this.sums.at(-1)!.tMs) this.sums = [];
    this.sums.push({ tMs, lost: lostOf(counts) });
    while (this.sums.length > 2 && this.sums[1]!.tMs <= tMs - this.lastMs) this.sums.shift();
    return this.sums.at(-1)!.lost - this.sums[0]!.lost;
  }
}

/** Says when to speak: where something changed, but never before the last sentence could be heard to its end. */
export class Pace {
  private said: string | null = null;
  private saidMs = -Infinity;

  constructor(private readonly leastMs: number) {}

  /** Whether to speak now; `what` tells one thing to say from another. */
  due(what: string, nowMs: number): boolean {
    if (what === this.said || nowMs - this.saidMs < this.leastMs) return false;
    this.said = what;
    this.saidMs = nowMs;
    return true;
  }
}

/** 'The leader drives forward; 3 followers turn left; 4 frames lost in the last 5 seconds.' */
export function tell(sight: Sight, lost: number, seconds: number): string {
  const list = (who: "leaders" | "followers") =>
    Object.entries(sight[who])
      .filter(([, count]) => count > 0)
      .map(([what, count]) => i18next.t(`mat.account.${who}.${what as Doing}`, { count }));
  const parts = [...list("leaders"), ...list("followers")];
  if (sight.lit) parts.push(i18next.t("mat.account.lit", { count: sight.lit }));
  if (lost) parts.push(i18next.t("mat.account.lost", { count: lost, seconds }));
  return parts.join(i18next.t("mat.account.between")) + i18next.t("mat.account.end");
}
