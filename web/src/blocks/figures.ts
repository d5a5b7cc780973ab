/** What a level means with the cars' profile, in the user's language. */

import type { Profile } from "../api/types";
import { say } from "../i18n";

/** A whole or decimal number without trailing zeros: 1500 ms are "1.5". */
export function plainSeconds(milliseconds: number): string {
  return String(milliseconds / 1000);
}

export function secondsMeaning(milliseconds = 0): string {
  return say("meaning.seconds", { seconds: plainSeconds(milliseconds) });
}

type Menu = "speed" | "light" | "radius";

/** What a level of a menu of steps means; `turning` for the speed of a turn. */
export function levelMeaning(profile: Profile, menu: Menu, level: number, turning = false): string {
  const [speed, rate] = [profile.speeds_mm_s[level] ?? 0, profile.turn_rates_deg_s[level] ?? 0];
  if (menu === "light") return levelWord("light", level);
  if (menu === "radius") return say("meaning.radius", { radius: (profile.avoid_radii_mm[level] ?? 0) / 10 });
  if ((turning ? rate : speed) === 0) return say("meaning.still");
  return turning ? say("meaning.turn", { rate }) : say("meaning.speed", { speed });
}

/** A level in a word: 'fast'. */
function levelWord(menu: Menu, level: number): string {
  return say(`levels.${menu}.${level as 0 | 1 | 2 | 3}`);
}

/** A level as a menu shows it: in a word, or with its figure. */
export function levelText(profile: Profile, menu: Menu, level: number, inWords = false): string {
  if (inWords) return levelWord(menu, level);
  return say(`blocks.${menu}`, { level, meaning: levelMeaning(profile, menu, level) });
}
