/** What the class stores, where, and for how long. */

import { useTexts } from "../i18n";
import { Page } from "../ui/page";
import css from "./class.module.css";

const POINTS = ["privacyRoom", "privacyStored", "privacyTeacher", "privacyOthers", "privacyEnd", "privacyCookie"] as const;

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
        <a href="/join">{t("back")}</a>
      </p>
    </Page>
  );
}
