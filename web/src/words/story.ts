/** A word told in a few words: 'drive · forward · fast · 3 s'. */

import i18next from "i18next";
import type { CompiledWord, Profile } from "../api/types";
import { durationMeaning, levelText } from "../blocks/figures";
import { WORD_FIELDS } from "../generated/steps";
import { valueOf } from "./bits";

const BETWEEN = " · ";
const AND = " + ";

function motor(word: CompiledWord, profile: Profile): string {
  const seconds = durationMeaning(profile, valueOf(word, "motor_duration"));
  if (!valueOf(word, "motor_speed")) return [i18next.t("story.wait"), seconds].join(BETWEEN);
  const direction = WORD_FIELDS.motor_direction.options[valueOf(word, "motor_direction")]!;
  return [i18next.t("story.drive"), i18next.t(`blocks.${direction}`), levelText(profile, "speed", valueOf(word, "motor_speed"), true), seconds].join(BETWEEN);
}

function timed(word: "led" | "avoid", menu: "light" | "radius", level: number, duration: number, profile: Profile): string {
  return [i18next.t(`story.${word}`), levelText(profile, menu, level, true), durationMeaning(profile, duration)].join(BETWEEN);
}

export function storyOf(word: CompiledWord, profile: Profile): string {
  if (word.part === "header") return i18next.t("story.header", { leader: valueOf(word, "leader_states"), followers: valueOf(word, "follower_words") });
  const told: string[] = [];
  if (valueOf(word, "motor_enable")) told.push(motor(word, profile));
  if (valueOf(word, "led_duration")) told.push(timed("led", "light", valueOf(word, "led_which"), valueOf(word, "led_duration"), profile));
  if (valueOf(word, "avoid_enable")) told.push(timed("avoid", "radius", valueOf(word, "avoid_radius"), valueOf(word, "avoid_duration"), profile));
  if (valueOf(word, "voice")) told.push(i18next.t("story.voice"));
  if (valueOf(word, "pir")) told.push(i18next.t("story.pir"));
  return told.length ? told.join(AND) : i18next.t("story.nothing");
}
