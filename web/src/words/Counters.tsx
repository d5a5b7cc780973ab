/** What the counters of the shown leader are now, under the names that the program gives them. */

import type { Decided } from "../generated/messages";
import { useTexts } from "../i18n";
import { shownDecisions, useMat } from "../mat/store";
import { useStudio } from "../state/studio";
import css from "./words.module.css";

/** Each counter of the program with its number: 'laps 3'. */
export function countersText({ counters }: Decided): string[] {
  const names = useStudio.getState().compiled?.counters ?? [];
  return counters.flatMap((count, counter) => (names[counter] ? `${names[counter]} ${count}` : []));
}

export function Counters() {
  const t = useTexts();
  const decided = useMat(shownDecisions);
  const texts = decided ? countersText(decided) : [];
  if (!texts.length) return null;
  return (
    <ul className={css.counters} aria-label={t("words.counters")}>
      {texts.map((text) => (
        <li key={text}>{text}</li>
      ))}
    </ul>
  );
}
