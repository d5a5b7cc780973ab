/** What the cars do at the moment of a picture: in numbers, as a sentence, and by which blocks. */

import { type CompiledWord, type EditorName, EDITORS } from "../api/types";
import { Flag, LATELY_S, NO_INDEX, NO_LED, type Picture } from "../api/world";
import { say } from "../i18n";
import type { Studio } from "../state/studio";

/** `driven` is a car that somebody drives, in any direction. */
const DIRECTIONS = ["forward", "left", "right", "driven"] as const;
/** `stuck` is to drive forward, and touches what lets it go no further. */
type Activity = (typeof DIRECTIONS)[number] | "stuck" | "still";

interface Summary {
  leaders: Record<Activity, number>;
  followers: Record<Activity, number>;
  lit: number;
  /** Words that somebody missed for good in the last LATELY_S. */
  lost: number;
}

function activityOf(wheels: number, flags: number): Activity {
  if (flags & Flag.stuck) return "stuck";
  return wheels & 3 ? (DIRECTIONS[wheels >> 2] ?? "still") : "still";
}

const noCars = (): Record<Activity, number> => ({ forward: 0, left: 0, right: 0, driven: 0, stuck: 0, still: 0 });

export function summarize(picture: Picture, leads: ReadonlySet<number>, missed: number): Summary {
  const summary: Summary = { leaders: noCars(), followers: noCars(), lit: 0, lost: missed };
  for (let k = 0; k < picture.cars; k++) {
    summary[leads.has(k) ? "leaders" : "followers"][activityOf(picture.wheels[k]!, picture.flags[k]!)] += 1;
    if (picture.led[k]! < NO_LED) summary.lit += 1;
  }
  return summary;
}

/**
 * What is said of missed words: `counted`, how many; `mentioned`, that some were lost, for a text that stays while their
 * number changes; `none`, nothing, for who has not met them yet.
 */
type Losses = "counted" | "mentioned" | "none";

/** 'The leader drives forward; 3 followers turn left; 4 messages missed in the last 5 seconds.' */
export function describe(summary: Summary, losses: Losses): string {
  const list = (who: "leaders" | "followers") =>
    Object.entries(summary[who])
      .filter(([, count]) => count > 0)
      .map(([what, count]) => say(`mat.account.${who}.${what as Activity}`, { count }));
  const parts = [...list("leaders"), ...list("followers")];
  if (summary.lit) parts.push(say("mat.account.lit", { count: summary.lit }));
  if (summary.lost && losses === "counted") parts.push(say("mat.account.lost", { count: summary.lost, seconds: LATELY_S }));
  if (summary.lost && losses === "mentioned") parts.push(say("mat.account.someLost", { seconds: LATELY_S }));
  return parts.length ? parts.join(say("mat.account.between")) + say("mat.account.end") : "";
}

/** Decides when to announce a text: not before a screen reader has finished the last one. */
export class Pace {
  private last: string | null = null;
  private lastAtMs = -Infinity;

  constructor(private readonly minimumMs: number) {}

  /** Whether to announce a text now; `isUrgent`, also where the last one is not finished: it speaks of another world. */
  due(text: string, nowMs: number, isUrgent = false): boolean {
    if (text === this.last || (!isUrgent && nowMs - this.lastAtMs < this.minimumMs)) return false;
    this.last = text;
    this.lastAtMs = nowMs;
    return true;
  }
}

type Running = Studio["running"];

/** The blocks that some car executes. */
export function runningBlocks(picture: Picture, words: readonly CompiledWord[]): Running {
  const executed = new Uint8Array(words.length);
  for (let k = 0; k < picture.cars; k++) {
    const index = picture.index[k]!;
    if (index !== NO_INDEX && picture.flags[k]! & Flag.runs) executed[index] = 1;
  }
  const running = new Map<EditorName, Set<string>>(EDITORS.map((editor) => [editor, new Set()]));
  words.forEach(({ part, block, fields_of }, place) => {
    if (!executed[place] || part === "header") return;
    const blocks = running.get(part)!;
    if (block !== null) blocks.add(block);
    for (const each of Object.values(fields_of ?? {})) blocks.add(each);
  });
  return new Map(EDITORS.map((editor) => [editor, [...running.get(editor)!].sort()]));
}

export function sameRunning(a: Running, b: Running): boolean {
  return EDITORS.every((editor) => (a.get(editor) ?? []).join() === (b.get(editor) ?? []).join());
}
