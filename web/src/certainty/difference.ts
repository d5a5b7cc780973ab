/** The first difference of two runs, in words. */

import i18next from "i18next";
import type { Difference } from "../generated/messages";
import { inLanguage } from "../i18n";
import { useStudio } from "../state/studio";
import { storyOf } from "../words/story";

/** Where the two runs part, as a sentence. */
export function differenceText(difference: Difference, names: readonly [string, string]): string {
  const { kind, t_ms, car, missed, late_ms, words, cause } = difference;
  const seconds = (t_ms / 1000).toFixed(1);
  const [one, other] = names;
  if (kind === "none") return i18next.t("compare.same");
  if (kind === "place") return i18next.t("compare.place", { car, seconds });
  const because = cause ? i18next.t("compare.because", { cause: inLanguage(cause) }) : "";
  if (missed === null) {
    const [first, second] = words.map(told);
    return i18next.t("compare.other", { car, seconds, one, other, first, second, because });
  }
  const said = { car, seconds, run: names[missed], word: told(words[1 - missed] ?? null), because };
  return late_ms === null ? i18next.t("compare.missed", said) : i18next.t("compare.late", { ...said, late: (late_ms / 1000).toFixed(1) });
}

/** A word as a story. */
export function told(hex: string | null): string {
  const { profileFigures } = useStudio.getState();
  if (hex === null || !profileFigures) return "";
  const leads = (useStudio.getState().compiled?.words ?? []).some(({ hex: each, part }) => part === "leader" && each === hex);
  return storyOf({ hex, part: leads ? "leader" : "followers", block: null }, profileFigures);
}
