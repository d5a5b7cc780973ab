/** The values of a word's fields, and which format a word has. */

import type { CompiledWord, Field } from "../api/types";
import { FORMATS } from "../generated/steps";

const placesOf = (fields: readonly Field[]) => new Map<string, Field>(fields.map((field) => [field.name, field]));
const PLACES = {
  header: placesOf(FORMATS.header),
  control: placesOf(FORMATS.control),
  state: placesOf(FORMATS.state),
  flow: placesOf(FORMATS.flow),
};
const FLOW_BIT = 2 ** FORMATS.flow[0].low;
/** The bits of the condition that ends a state; a leader that doesn't decide has none there. */
const UNTIL_BITS = 0x7f0;

/** The format of a word. */
export function kindOf({ part, hex }: CompiledWord): keyof typeof FORMATS {
  if (part !== "leader") return part === "header" ? "header" : "control";
  const bits = parseInt(hex, 16);
  if (bits >= FLOW_BIT) return "flow";
  return bits & UNTIL_BITS ? "state" : "control";
}

/** Whether it is a word that takes no time. */
export const isFlow = (word: CompiledWord): boolean => kindOf(word) === "flow";

/** The value of a field; 0 where words of this kind have no such field. */
export function valueOf(word: CompiledWord, field: string): number {
  const place = PLACES[kindOf(word)].get(field);
  return place ? (parseInt(word.hex, 16) >>> place.low) & (2 ** (place.high - place.low + 1) - 1) : 0;
}

/** Whether a word of this kind has the field. */
export const hasField = (word: CompiledWord, field: string): boolean => PLACES[kindOf(word)].has(field);
