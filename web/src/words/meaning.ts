/** What a field's value means to the car. */

import i18next from "i18next";
import type { CompiledWord, Field, Profile } from "../api/types";
import { durationMeaning, dwellMeaning, levelMeaning } from "../blocks/figures";
import { inLanguage } from "../i18n";
import { stepField } from "./bits";

/** Whether it is a header word whose follower words travel with a tag. */
const isTagged = (word: CompiledWord) => word.part === "header" && word.values.reserved === 1;

const sentFor = (word: CompiledWord, dwell: string) => (isTagged(word) ? i18next.t("meaning.dwellTagged", { dwell }) : dwell);

function valueMeaning(word: CompiledWord, field: string, value: number, profile: Profile): string {
  const declared = stepField(field);
  if (declared) {
    switch (declared.meaning) {
      case "choice":
        return i18next.t(`blocks.${declared.options[value] ?? declared.options[0]}`);
      case "level": {
        const turning = word.values.motor_direction === 1 || word.values.motor_direction === 2;
        return levelMeaning(profile, declared.menu, value, turning);
      }
      case "duration":
        return durationMeaning(profile, value);
      case "flag":
        return i18next.t(value ? "blocks.yes" : "blocks.no");
    }
  }
  switch (field) {
    case "leader_states":
    case "follower_words":
      return String(value);
    case "dwell":
      return value === 0 ? i18next.t("meaning.nothing") : sentFor(word, dwellMeaning(profile, Math.log2(value)));
    case "reserved":
      return i18next.t(isTagged(word) ? "meaning.tagged" : "meaning.reserved");
    case "parity":
      return i18next.t("meaning.parity");
    default:
      return i18next.t(value ? "blocks.yes" : "blocks.no");
  }
}

/** The whole of it in a line: which bits, whose they are, what they say. */
export function fieldMeaning(word: CompiledWord, field: Field, profile: Profile): string {
  const value = word.values[field.name] ?? 0;
  const bits = field.high === field.low ? String(field.high) : `${field.high}–${field.low}`;
  const meaning = valueMeaning(word, field.name, value, profile);
  return i18next.t(meaning === String(value) ? "words.count" : "words.field", {
    bits,
    title: inLanguage(field.title),
    value,
    meaning,
  });
}
