/** What a level means with the cars' profile, in the user's language. */

import i18next from "i18next";
import type { Profile } from "../api/types";

/** A whole or decimal number without trailing zeros: 1500 ms are "1.5". */
export function plainSeconds(milliseconds: number): string {
  return String(milliseconds / 1000);
}

export function secondsMeaning(milliseconds = 0): string {
  return i18next.t("meaning.seconds", { seconds: plainSeconds(milliseconds) });
}

type Menu = "speed" | "light" | "radius";

/** What a level of a menu of steps means; `turning` for the speed of a turn. */
export function levelMeaning(profile: Profile, menu: Menu, level: number, turning = false): string {
  const [speed, rate] = [profile.speeds_mm_s[level] ?? 0, profile.turn_rates_deg_s[level] ?? 0];
  if (menu === "light") return levelWord("light", level);
  if (menu === "radius") return i18next.t("meaning.radius", { radius: (profile.avoid_radii_mm[level] ?? 0) / 10 });
  if ((turning ? rate : speed) === 0) return i18next.t("meaning.still");
  return turning ? i18next.t("meaning.turn", { rate }) : i18next.t("meaning.speed", { speed });
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
