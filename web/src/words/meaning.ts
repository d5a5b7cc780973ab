/** What a field's value means to the car. */

import i18next from "i18next";
import type { CompiledWord, Field, Profile } from "../api/types";
import { durationMeaning, dwellMeaning, radiusMeaning, speedMeaning, turnMeaning } from "../blocks/figures";
import { inLanguage } from "../i18n";

const DIRECTIONS = ["forward", "left", "right", "random"] as const;

function valueMeaning(word: CompiledWord, field: string, value: number, profile: Profile): string {
  switch (field) {
    case "leader_states":
    case "follower_words":
      return String(value);
    case "dwell":
      return value === 0 ? i18next.t("meaning.nothing") : dwellMeaning(profile, Math.log2(value));
    case "motor_direction":
      return i18next.t(`blocks.${DIRECTIONS[value] ?? "forward"}`);
    case "motor_speed": {
      const turning = word.values.motor_direction === 1 || word.values.motor_direction === 2;
      return (turning ? turnMeaning : speedMeaning)(profile, value);
    }
    case "avoid_radius":
      return radiusMeaning(profile, value);
    case "led_which":
      return i18next.t("blocks.light", { which: value });
    case "motor_duration":
    case "led_duration":
    case "avoid_duration":
      return durationMeaning(profile, value);
    case "reserved":
      return i18next.t("meaning.reserved");
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
