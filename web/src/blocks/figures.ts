/** What a level means with the cars' profile, in the user's language. */

import i18next from "i18next";
import type { Profile } from "../api/types";

/** A whole or decimal number without trailing zeros: 1500 ms are "1.5". */
export function plainSeconds(milliseconds: number): string {
  return String(milliseconds / 1000);
}

export function speedMeaning(profile: Profile, level: number): string {
  const speed = profile.speeds_mm_s[level] ?? 0;
  return speed === 0 ? i18next.t("meaning.still") : i18next.t("meaning.speed", { speed });
}

export function turnMeaning(profile: Profile, level: number): string {
  const rate = profile.turn_rates_deg_s[level] ?? 0;
  return rate === 0 ? i18next.t("meaning.still") : i18next.t("meaning.turn", { rate });
}

export function radiusMeaning(profile: Profile, level: number): string {
  return i18next.t("meaning.radius", { radius: (profile.avoid_radii_mm[level] ?? 0) / 10 });
}

export function durationMeaning(profile: Profile, level: number): string {
  return i18next.t("meaning.seconds", { seconds: plainSeconds(profile.durations_ms[level] ?? 0) });
}

export function dwellMeaning(profile: Profile, level: number): string {
  return i18next.t("meaning.seconds", { seconds: plainSeconds(profile.dwell_ms[level] ?? 0) });
}

type Menu = "speed" | "light" | "radius";

/** What a level of a menu of steps means; `turning` for the speed of a turn. */
export function levelMeaning(profile: Profile, menu: Menu, level: number, turning = false): string {
  switch (menu) {
    case "speed":
      return (turning ? turnMeaning : speedMeaning)(profile, level);
    case "radius":
      return radiusMeaning(profile, level);
    case "light":
      return levelWord("light", level);
  }
}

/** A level in a word: 'fast'. */
function levelWord(menu: Menu, level: number): string {
  return i18next.t(`levels.${menu}.${level as 0 | 1 | 2 | 3}`);
}

/** A level as a menu shows it: in a word, or with its figure. */
export function levelText(profile: Profile, menu: Menu, level: number, inWords = false): string {
  if (inWords) return levelWord(menu, level);
  return i18next.t(`blocks.${menu}`, { level, meaning: levelMeaning(profile, menu, level) });
}
