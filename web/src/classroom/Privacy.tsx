/** What the class stores, where, and for how long. */

import { Frame } from "./Frame";
import css from "./class.module.css";
import { useTexts } from "./texts";

const POINTS = ["privacyRoom", "privacyStored", "privacyTeacher", "privacyOthers", "privacyEnd", "privacyCookie"] as const;

export function Privacy() {
  const t = useTexts();
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
