/** A word's bits, field by field, and which block each belongs to. */

import type { CompiledWord, Field } from "../api/types";
import { HUES, WORD_FIELDS } from "../generated/steps";

type StepField = keyof typeof WORD_FIELDS;
export type Group = (typeof WORD_FIELDS)[StepField]["group"] | "count" | "dwell" | "infrared" | "reserved" | "parity";

/** The groups of the fields that no step fills. */
const OTHER_GROUPS: Record<string, Group> = {
  leader_states: "count",
  follower_words: "count",
  dwell: "dwell",
  accept_ir: "infrared",
  forward: "infrared",
  parity: "parity",
};

/** What a step's field means; undefined for a field that no step fills. */
export function stepField(field: string): (typeof WORD_FIELDS)[StepField] | undefined {
  return field in WORD_FIELDS ? WORD_FIELDS[field as StepField] : undefined;
}

/** What the field has to do with, which is also its colour. */
export function groupOf(field: string): Group {
  return stepField(field)?.group ?? OTHER_GROUPS[field] ?? "reserved";
}

/** The colour of the field's bits: of the hue that its group is declared with, or the style sheet's own. */
export function colourOf(field: string): string {
  const group = groupOf(field);
  return group in HUES ? `hsl(${HUES[group as keyof typeof HUES]} var(--bits-shade))` : `var(--bits-${group})`;
}

/** Whether the field is one bit that has a group for itself: its column is widened for the group's name. */
export function isNarrow(fields: readonly Field[], { name, high, low }: Field): boolean {
  return high === low && fields.filter((each) => groupOf(each.name) === groupOf(name)).length === 1;
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
export function isLit(word: CompiledWord, field: string, blocks: ReadonlySet<string>): boolean {
  const group = groupOf(field);
  if (group === "reserved" || group === "parity" || blocks.size === 0) return false;
  const block = blockOf(word, field);
  return block !== null && blocks.has(block);
}

const sameWord = (a: CompiledWord | undefined, b: CompiledWord) =>
  a?.hex === b.hex && a.part === b.part && a.block === b.block && JSON.stringify(a.fields_of) === JSON.stringify(b.fields_of);

/** The new words, but the old objects where nothing changed: what shows them need not be made anew. */
export function sharedWords(before: readonly CompiledWord[], now: readonly CompiledWord[]): CompiledWord[] {
  return now.map((word, place) => (sameWord(before[place], word) ? before[place]! : word));
}

export interface Span {
  group: Group;
  fields: Field[];
}

/** The fields in runs of one colour, for the table's head. */
export function spansOf(fields: readonly Field[]): Span[] {
  const spans: Span[] = [];
  for (const field of fields) {
    const group = groupOf(field.name);
    const last = spans.at(-1);
    if (last?.group === group) last.fields.push(field);
    else spans.push({ group, fields: [field] });
  }
  return spans;
}
