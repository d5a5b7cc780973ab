/** A word's bits, field by field: which block each belongs to, what its value means to the car, and a table for a spreadsheet. */

import type { CompiledWord, Field, Profile } from "../api/types";
import { FORMATS, HUES } from "../generated/steps";
import i18next from "i18next";
import { levelMeaning, secondsMeaning } from "../blocks/figures";

/** Whether the field's bits say something: reserved bits and the parity don't. */
export const isTold = ({ group }: Field): boolean => group !== "reserved" && group !== "parity";

/** The colour of the field's bits: of the hue that its group is declared with, or the style sheet's own. */
export function colourOf({ group }: Field): string {
  return group in HUES ? `hsl(${HUES[group as keyof typeof HUES]} var(--bits-shade))` : `var(--bits-${group})`;
}

/** Whether the field is one bit that has a group for itself: its column is widened for the group's name. */
export function isNarrow(fields: readonly Field[], { group, high, low }: Field): boolean {
  return high === low && fields.filter((each) => each.group === group).length === 1;
}

const placesOf = (fields: readonly Field[]) => new Map<string, Field>(fields.map((field) => [field.name, field]));
const kindOf = ({ part }: CompiledWord) => (part === "header" ? "header" : "control");
const PLACES = { header: placesOf(FORMATS.header), control: placesOf(FORMATS.control) };

/** The value of a field; 0 where words of this kind have no such field. */
export function valueOf(word: CompiledWord, field: string): number {
  const place = PLACES[kindOf(word)].get(field);
  return place ? (parseInt(word.hex, 16) >>> place.low) & (2 ** (place.high - place.low + 1) - 1) : 0;
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
  return [word.block, ...Object.values(word.fields_of ?? {})].some((block) => block !== null && blocks.has(block));
}

/** Whether the field is there because of one of these blocks: its bits light up with them. */
export function isLit(word: CompiledWord, field: Field, blocks: ReadonlySet<string>): boolean {
  const block = blockOf(word, field.name);
  return isTold(field) && block !== null && blocks.has(block);
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
const isTagged = (word: CompiledWord) => word.part === "header" && valueOf(word, "reserved") % 2 === 1;

const sentFor = (word: CompiledWord, dwell: string) => (isTagged(word) ? i18next.t("meaning.dwellTagged", { dwell }) : dwell);

function valueMeaning(word: CompiledWord, field: Field, value: number, profile: Profile): string {
  if ("meaning" in field) {
    switch (field.meaning) {
      case "choice":
        return i18next.t(`blocks.${field.options[value] ?? field.options[0]}`);
      case "level": {
        const turning = [1, 2].includes(valueOf(word, "motor_direction"));
        return levelMeaning(profile, field.menu, value, turning);
      }
      case "duration":
        return secondsMeaning(profile.durations_ms[value]);
      case "flag":
        return i18next.t(value ? "blocks.yes" : "blocks.no");
    }
  }
  switch (field.name) {
    case "leader_states":
    case "follower_words":
      return String(value);
    case "dwell":
      return value === 0 ? i18next.t("meaning.nothing") : sentFor(word, secondsMeaning(profile.dwell_ms[Math.log2(value)]));
    case "reserved":
      return i18next.t(isTagged(word) ? "meaning.tagged" : "meaning.reserved");
    case "parity":
      return i18next.t("meaning.parity");
    default:
      return i18next.t(value ? "blocks.yes" : "blocks.no");
  }
}

/** A line that describes a field of a word: its bits, its title and the meaning of its value. */
export function fieldMeaning(word: CompiledWord, field: Field, profile: Profile): string {
  const value = valueOf(word, field.name);
  const bits = field.high === field.low ? String(field.high) : `${field.high}–${field.low}`;
  const meaning = valueMeaning(word, field, value, profile);
  return i18next.t(meaning === String(value) ? "words.count" : "words.field", {
    bits,
    title: i18next.t(`fields.${field.name}`),
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

/** A line for each word: its index, part, bytes, bits, and every field of both formats. */
export function wordsCsv(words: readonly CompiledWord[]): string {
  const fields: readonly Field[] = [...FORMATS.header.filter(({ name }) => name !== "reserved"), ...FORMATS.control];
  const lines = words.map((word, index) => [
    index,
    word.part,
    `0x${word.hex.toUpperCase()}`,
    parseInt(word.hex, 16).toString(2).padStart(32, "0"),
    ...fields.map(({ name }) => (PLACES[kindOf(word)].has(name) ? valueOf(word, name) : "")),
  ]);
  return [["index", "part", "hex", "bits", ...fields.map(({ name }) => name)], ...lines].map((line) => line.join(",") + "\r\n").join("");
}
