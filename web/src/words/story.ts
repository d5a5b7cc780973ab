/** A word told in a few words: 'drive · forward · fast · 3 s'. */

import type { CompiledWord, Profile } from "../api/types";
import { levelText, secondsMeaning } from "../blocks/figures";
import { STEP_KINDS } from "../generated/steps";
import { say } from "../i18n";
import { endedStory, flowStory } from "./deciding";
import { isFlow, valueOf } from "./values";

const BETWEEN = " · ";
const AND = " + ";
/** The kinds of steps that have bits of a word. */
const TOLD = STEP_KINDS.filter((each) => "group" in each);
type Told = (typeof TOLD)[number];
type Field = Told["fields"][number];

/** What a field says; null for bits that no step of its kind has. */
function fieldText(word: CompiledWord, field: Field, profile: Profile): string | null {
  if (!("word" in field)) return "";
  const value = valueOf(word, field.word);
  switch (field.input) {
    case "seconds":
      return secondsMeaning(profile.durations_ms[value]);
    case "choice": {
      const option = field.options[value - field.least];
      return option === undefined ? null : say(`blocks.${option}`);
    }
    case "level":
      return (field.levels as readonly number[]).includes(value) ? levelText(profile, field.menu, value, true) : null;
  }
}

/** How many of its bits say that the word has a step of this kind; 0 where one says otherwise. A kind without such has a time. */
function fit(word: CompiledWord, { sets, fields }: Told, profile: Profile): number {
  const set = Object.entries(sets);
  if (fields.some((field) => fieldText(word, field, profile) === null)) return 0;
  if (set.length) return set.every(([name, value]) => valueOf(word, name) === value) ? set.length : 0;
  return fields.some((field) => field.input === "seconds" && "word" in field && valueOf(word, field.word)) ? 1 : 0;
}

/** The kinds of a word's steps: of each group the one that says most, unless others have said it all. */
function kindsOf(word: CompiledWord, profile: Profile): Told[] {
  const told: Told[] = [];
  const said = new Set<string>();
  for (const group of new Set(TOLD.map((each) => each.group))) {
    const fits = TOLD.filter((each) => each.group === group).map((kind) => ({ kind, bits: fit(word, kind, profile) }));
    const { kind, bits } = fits.reduce((best, each) => (each.bits > best.bits ? each : best));
    const names = Object.keys(kind.sets);
    if (!bits || (names.length && names.every((name) => said.has(name)))) continue;
    told.push(kind);
    for (const name of names) said.add(name);
  }
  return told;
}

function kindStory(word: CompiledWord, { kind, fields }: Told, profile: Profile): string {
  const texts = fields.map((field) => ({ field, text: fieldText(word, field, profile) ?? "" }));
  const direction = texts.find(({ field }) => field.input === "choice")?.text ?? "";
  const after = texts.filter(({ field, text }) => field.input !== "choice" && text).map(({ text }) => text);
  return [say(`story.${kind}`, { direction }), ...after].join(BETWEEN);
}

/** The stories of steps that start together: what a drive minds is told with it. */
function mindingStories(word: CompiledWord, kinds: readonly Told[], profile: Profile): string[] {
  const drive = kinds.find((kind) => kind.drives);
  const minded = drive ? kinds.filter((kind) => isMindedBy(word, kind)) : [];
  const holding = minded.filter(({ kind }) => kind !== "avoid").map(({ kind }) => say(`story.minds.${kind as "pir"}`));
  const turning = minded
    .filter(({ kind }) => kind === "avoid")
    .map(({ fields }) => [say("story.turnsAway"), fieldText(word, fields[0], profile)].join(BETWEEN));
  const unless = holding.length ? [say("story.unlessMinded", { minded: holding.join(` ${say("blocks.or")} `) })] : [];
  const left = kinds.filter((kind) => !minded.includes(kind));
  return left.map((kind) => [kindStory(word, kind, profile), ...(kind === drive ? [...unless, ...turning] : [])].join(BETWEEN));
}

/** Whether a step beside a drive is what the drive minds. Who avoids obstacles for another time does so by a block of its own. */
function isMindedBy(word: CompiledWord, { kind }: Told): boolean {
  if (kind === "avoid") return valueOf(word, "avoid_duration") === valueOf(word, "motor_duration");
  return kind === "pir" || kind === "voice" || kind === "floor";
}

export function storyOf(word: CompiledWord, profile: Profile): string {
  if (word.part === "header") return say("story.header", { leader: valueOf(word, "leader_states"), followers: valueOf(word, "follower_words") });
  if (isFlow(word)) return flowStory(word, profile);
  const told = mindingStories(word, kindsOf(word, profile), profile);
  return endedStory(word, told.length ? told.join(AND) : say("story.nothing"), profile);
}
