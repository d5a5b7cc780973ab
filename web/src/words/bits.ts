/** A word's bits, field by field: which block each belongs to, what its value means to the car, and a table for a spreadsheet. */

import type { CompiledWord, Field, Profile } from "../api/types";
import { FORMATS, HUES } from "../generated/steps";
import { levelMeaning, secondsMeaning } from "../blocks/figures";
import { say } from "../i18n";
import { askedKeyOf, decidingMeaning } from "./deciding";
import { hasField, kindOf, valueOf } from "./values";

/** Whether the field's bits say something: reserved bits and the parity don't. */
export const isTold = ({ group }: Field): boolean => group !== "reserved" && group !== "parity";

/** Of the fields that only the words of a leader that decides have. */
const DECIDING_HUES = { flow: 220, op: 133, target: 200, condition: 175, until: 175, counter: 24, value: 24 } as const;
const ALL_HUES: Partial<Record<Field["group"], number>> = { ...DECIDING_HUES, ...HUES };

/** The colour of the field's bits: of the hue that its group is declared with, or the style sheet's own. */
export function colourOf({ group }: Field): string {
  const hue = ALL_HUES[group];
  return hue === undefined ? `var(--bits-${group})` : `hsl(${hue} var(--bits-shade))`;
}

/** Whether the field is one bit that has a group for itself: its column is widened for the group's name. */
export function isNarrow(fields: readonly Field[], { group, high, low }: Field): boolean {
  return high === low && fields.filter((each) => each.group === group).length === 1;
}

/** The field's bits as they stand in the word, most significant first. */
export function bitsOf(word: CompiledWord, { high, low }: Field): string {
  const bits = parseInt(word.hex, 16).toString(2).padStart(32, "0");
  return bits.slice(31 - high, 32 - low);
}

export function blockOf(word: CompiledWord, field: string): string | null {
  return word.fields_of?.[field] ?? word.block;
}

export function hasBlockIn(word: CompiledWord, blocks: ReadonlySet<string>): boolean {
  const own = [word.block, ...Object.values(word.fields_of ?? {}), askedKeyOf(word, word.block)];
  return own.some((block) => block !== null && blocks.has(block));
}

/** Whether the field is there because of one of these blocks: its bits light up with them. */
export function isLit(word: CompiledWord, field: Field, blocks: ReadonlySet<string>): boolean {
  const block = blockOf(word, field.name);
  const asked = askedKeyOf(word, word.block, field);
  return isTold(field) && ((block !== null && blocks.has(block)) || (asked !== null && blocks.has(asked)));
}

const sameWord = (a: CompiledWord | undefined, b: CompiledWord) =>
  a?.hex === b.hex && a.part === b.part && a.block === b.block && JSON.stringify(a.fields_of) === JSON.stringify(b.fields_of);

/** The new words, but the old objects where nothing changed, so that their rows need not be drawn again. */
export function sharedWords(before: readonly CompiledWord[], now: readonly CompiledWord[]): CompiledWord[] {
  return now.map((word, place) => (sameWord(before[place], word) ? before[place]! : word));
}

interface BitSpan {
  group: Field["group"];
  fields: Field[];
}

/** The fields in runs of one colour, for the table's head. */
export function spansOf(fields: readonly Field[]): BitSpan[] {
  const spans: BitSpan[] = [];
  for (const field of fields) {
    const last = spans.at(-1);
    if (last?.group === field.group) last.fields.push(field);
    else spans.push({ group: field.group, fields: [field] });
  }
  return spans;
}

/** Whether it is a header word whose follower words travel with a tag. */
const isTagged = (word: CompiledWord) => word.part === "header" && (valueOf(word, "reserved") & 1) === 1;

const sentFor = (word: CompiledWord, dwell: string) => (isTagged(word) ? say("meaning.dwellTagged", { dwell }) : dwell);

function valueMeaning(word: CompiledWord, field: Field, value: number, profile: Profile): string {
  if ("meaning" in field) {
    switch (field.meaning) {
      case "choice":
        return say(`blocks.${field.options[value] ?? field.options[0]}`);
      case "level": {
        const turning = [1, 2].includes(valueOf(word, "motor_direction"));
        return levelMeaning(profile, field.menu, value, turning);
      }
      case "duration":
        return secondsMeaning(profile.durations_ms[value]);
      case "flag":
        return say(value ? "blocks.yes" : "blocks.no");
    }
  }
  const deciding = decidingMeaning(word, field, value, profile);
  if (deciding !== null) return deciding;
  switch (field.name) {
    case "leader_states":
    case "follower_words":
      return String(value);
    case "dwell":
      return value === 0 ? say("meaning.nothing") : sentFor(word, secondsMeaning(profile.dwell_ms[Math.log2(value)]));
    case "reserved":
      return say(isTagged(word) ? "meaning.tagged" : "meaning.reserved");
    case "parity":
      return say("meaning.parity");
    default:
      return say(value ? "blocks.yes" : "blocks.no");
  }
}

/** A line that describes a field of a word: its bits, its title and the meaning of its value. */
export function fieldMeaning(word: CompiledWord, field: Field, profile: Profile): string {
  const value = valueOf(word, field.name);
  const bits = say(field.high === field.low ? "words.oneBit" : "words.bits", { high: field.high, low: field.low });
  const meaning = valueMeaning(word, field, value, profile);
  return say(meaning === String(value) ? "words.count" : "words.field", {
    bits,
    title: say(`fields.${field.name}`),
    value,
    meaning,
  });
}

/** The fields of a word of this kind. */
export const fieldsOf = (word: CompiledWord): readonly Field[] => FORMATS[kindOf(word)];

/** The 32 bits of a word, field by field, most significant first. */
export function runsOf(word: CompiledWord): { field: Field; bits: string; isSet: boolean }[] {
  return fieldsOf(word).map((field) => ({ field, bits: bitsOf(word, field), isSet: valueOf(word, field.name) !== 0 }));
}

/** A line for each word: its index, part, bytes, bits, and every field of the formats that the words have. */
export function wordsCsv(words: readonly CompiledWord[]): string {
  const formats = new Set<keyof typeof FORMATS>(["header", "control", ...words.map(kindOf)]);
  const all = [...formats].flatMap((format): readonly Field[] => (format === "header" ? FORMATS.header.filter(isTold) : FORMATS[format]));
  const fields = all.filter(({ name }, at) => all.findIndex((field) => field.name === name) === at);
  const lines = words.map((word, index) => [
    index,
    word.part,
    `0x${word.hex.toUpperCase()}`,
    parseInt(word.hex, 16).toString(2).padStart(32, "0"),
    ...fields.map(({ name }) => (hasField(word, name) ? valueOf(word, name) : "")),
  ]);
  return [["index", "part", "hex", "bits", ...fields.map(({ name }) => name)], ...lines].map((line) => line.join(",") + "\r\n").join("");
}
