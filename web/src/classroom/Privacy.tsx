/** What the class stores, where, and for how long. */

import { useTexts } from "../i18n";
import { Frame } from "./Frame";
import css from "./class.module.css";

const POINTS = ["privacyRoom", "privacyStored", "privacyTeacher", "privacyOthers", "privacyEnd", "privacyCookie"] as const;

export function Privacy() {
  const t = useTexts("class");
  return (
    <Frame title={t("privacyTitle")} narrow>
      <ul className={css.points}>
        {POINTS.map((point) => (
          <li key={point}>{t(point)}</li>
        ))}
      </ul>
      <p>
        <a href="/join">{t("back")}</a>
      </p>
    </Frame>
  );
}
