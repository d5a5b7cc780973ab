import { useTexts } from "../i18n";
import css from "./missions.module.css";

/** Stars of a mission, of which some are earned. */
export function Stars({ stars, earned }: { stars: readonly number[]; earned: readonly number[] }) {
  const t = useTexts();
  return (
    <span className={css.stars} role="img" aria-label={t("missions.stars", { count: earned.length, most: stars.length })}>
      {stars.map((star) => (
        <span key={star} data-earned={earned.includes(star) || undefined}>
          {earned.includes(star) ? "★" : "☆"}
        </span>
      ))}
    </span>
  );
}
