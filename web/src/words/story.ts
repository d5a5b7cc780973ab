/** A word told in a few words: 'drive · forward · fast · 3 s'. */

import i18next from "i18next";
import type { CompiledWord, Profile } from "../api/types";
import { durationMeaning, levelText } from "../blocks/figures";
import { WORD_FIELDS } from "../generated/steps";

const BETWEEN = " · ";
const AND = " + ";

function motor({ values }: CompiledWord, profile: Profile): string {
  const seconds = durationMeaning(profile, values.motor_duration ?? 0);
  if (!values.motor_speed) return [i18next.t("story.wait"), seconds].join(BETWEEN);
  const direction = WORD_FIELDS.motor_direction.options[values.motor_direction ?? 0]!;
  return [i18next.t("story.drive"), i18next.t(`blocks.${direction}`), levelText(profile, "speed", values.motor_speed, true), seconds].join(BETWEEN);
}

function timed(word: "led" | "avoid", menu: "light" | "radius", level: number, duration: number, profile: Profile): string {
  return [i18next.t(`story.${word}`), levelText(profile, menu, level, true), durationMeaning(profile, duration)].join(BETWEEN);
}

export function storyOf(word: CompiledWord, profile: Profile): string {
  const { values } = word;
  if (word.part === "header") return i18next.t("story.header", { leader: values.leader_states, followers: values.follower_words });
  const told: string[] = [];
  if (values.motor_enable) told.push(motor(word, profile));
  if (values.led_duration) told.push(timed("led", "light", values.led_which ?? 0, values.led_duration, profile));
  if (values.avoid_enable) told.push(timed("avoid", "radius", values.avoid_radius ?? 0, values.avoid_duration ?? 0, profile));
  if (values.voice) told.push(i18next.t("story.voice"));
  if (values.pir) told.push(i18next.t("story.pir"));
  return told.length ? told.join(AND) : i18next.t("story.nothing");
}
