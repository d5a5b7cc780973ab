/** The words of a leader that decides: what a flow word does, and the conditions in its words. */

import { say } from "../i18n";
import type { CompiledWord, Field, Profile } from "../api/types";
import { levelMeaning } from "../blocks/figures";
import { useStudio } from "../state/studio";
import { FLOW_CONDITIONS, FLOW_OPS, SENSES } from "../generated/steps";
import { valueOf } from "./values";

export const COMPARISONS = ["is", "below", "above"] as const;
const IN_TURN = 255;
const LOTS = 256;
/** The fields of a condition, and those that say what it is compared with. */
const ASKING = new Set<Field["group"]>(["condition", "until", "counter", "value"]);

/** What the program calls a counter; its number where it has no name. */
export function counterName(counter: number): string {
  const name = useStudio.getState().compiled?.counters[counter] ?? "";
  return name === "" ? say("story.counter", { number: counter + 1 }) : name;
}

/** Whether the field says what a condition asks. */
export const asks = ({ group }: Field): boolean => ASKING.has(group);

export interface Asked {
  kind: (typeof FLOW_CONDITIONS)[number];
  level: number;
}

/** The condition of a flow word, or the one that ends a state; null where the word has none. */
export function askedBy(word: CompiledWord): Asked | null {
  const isFlow = valueOf(word, "flow") === 1;
  const kind = FLOW_CONDITIONS[valueOf(word, isFlow ? "condition" : "until")] ?? "always";
  return kind === "always" ? null : { kind, level: valueOf(word, isFlow ? "level" : "until_level") };
}

/** A condition of a step's block, among the blocks that light up bits. */
export const askedKey = (block: string, { kind, level }: Asked) => `${block}?${kind}/${level}`;

/** The key of the condition that a field of a word belongs to; null where it belongs to none. */
export function askedKeyOf(word: CompiledWord, block: string | null, field?: Field): string | null {
  const asked = block !== null && (!field || asks(field)) ? askedBy(word) : null;
  return asked && askedKey(block!, asked);
}

/** A condition in a few words, without whether it has to hold. */
export function askedMeaning(word: CompiledWord, { kind, level }: Asked, profile: Profile): string {
  const value = valueOf(word, "value");
  switch (kind) {
    case "obstacle":
      return say("story.asked.obstacle", { radius: levelMeaning(profile, "radius", level) });
    case "voice":
      return say("story.asked.voice", { word: say(`blocks.asked.${SENSES.voice[level] ?? "stop"}`) });
    case "floor":
      return say("story.asked.floor", { where: say(`blocks.asked.${SENSES.floor[level] ?? "either"}`) });
    case "counter": {
      const comparison = say(`blocks.asked.${COMPARISONS[level] ?? "is"}`);
      return say("story.asked.counter", { counter: counterName(valueOf(word, "counter")), comparison, value });
    }
    case "chance":
      return say("story.asked.chance", { percent: Math.round((value * 100) / LOTS) });
    default:
      return say("story.asked.person");
  }
}

/** What a flow word does. */
function actOf(word: CompiledWord): string {
  const target = valueOf(word, "target");
  const figures = { target: target + 1, counter: counterName(valueOf(word, "counter")), value: valueOf(word, "value") };
  switch (FLOW_OPS[valueOf(word, "op")]) {
    case "call":
      return say("story.call", figures);
    case "return":
      return say("story.return");
    case "count":
      return say(`story.count.${valueOf(word, "level") as 0 | 1 | 2 | 3}`, figures);
    case "tell":
      return target === IN_TURN ? say("story.inTurn") : say("story.tell", figures);
    default:
      return say("story.jump", figures);
  }
}

/** Whether the flow word goes on only under a condition, which jumps and calls have. */
const branches = (word: CompiledWord) => valueOf(word, "op") <= FLOW_OPS.indexOf("call");

export function flowStory(word: CompiledWord, profile: Profile): string {
  const act = actOf(word);
  const asked = branches(word) ? askedBy(word) : null;
  if (!asked) return act;
  const condition = askedMeaning(word, asked, profile);
  return say(valueOf(word, "if_not") ? "story.unless" : "story.if", { act, condition });
}

/** The story of a state, with the condition that ends it. */
export function endedStory(word: CompiledWord, story: string, profile: Profile): string {
  const asked = askedBy(word);
  if (!asked) return story;
  const condition = askedMeaning(word, asked, profile);
  return say(valueOf(word, "until_not") ? "story.whileHolds" : "story.until", { act: story, condition });
}

/** What the value of a field says that only words of a leader that decides have; null for other fields. */
export function decidingMeaning(word: CompiledWord, field: Field, value: number, profile: Profile): string | null {
  const asked = askedBy(word);
  switch (field.name) {
    case "flow":
      return say(value ? "meaning.flowWord" : "meaning.state");
    case "op":
      return say(`flow.${FLOW_OPS[value] ?? "jump"}`);
    case "target":
      return value === IN_TURN && FLOW_OPS[valueOf(word, "op")] === "tell" ? say("story.inTurn") : String(value);
    case "condition":
    case "until":
      return asked ? askedMeaning(word, asked, profile) : say("meaning.nothing");
    case "if_not":
    case "until_not":
      return say(value ? "blocks.yes" : "blocks.no");
    case "level":
    case "until_level":
    case "value":
      return String(value);
    case "counter":
      return counterName(value);
    case "unused":
      return say("meaning.reserved");
    default:
      return null;
  }
}
