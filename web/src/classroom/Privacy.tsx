/** What the class stores, where, and for how long. */

import type { MouseEvent } from "react";
import { useTexts } from "../i18n";
import { Page } from "../ui/page";
import css from "./class.module.css";

const POINTS = ["privacyRoom", "privacyStored", "privacyTeacher", "privacyOthers", "privacyEnd", "privacyCookie"] as const;

/** Back to where one read about it, a teacher's page or a pupil's; who came by an address alone goes to where one comes in. */
function goBack(event: MouseEvent): void {
  if (history.length === 1) return;
  event.preventDefault();
  history.back();
}

export function Privacy() {
  const t = useTexts("class");
  return (
    <Page title={t("privacyTitle")} className={css.narrow}>
      <ul className={css.points}>
        {POINTS.map((point) => (
          <li key={point}>{t(point)}</li>
        ))}
      </ul>
      <p>
        <a href="/join" onClick={goBack}>{t("back")}</a>
      </p>
    </Page>
  );
}
