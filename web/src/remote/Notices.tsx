import { link } from "./driving";
import { useRemote } from "./link";
import { useLanguage, useTexts } from "./texts";
import css from "./remote.module.css";
import buttons from "../ui/buttons.module.css";

const FULL_DUTY = 255;

/** What the car does and who drives it, in a line, and what is wrong, if something is. */
export function Notices({ car }: { car: string | null }) {
  const t = useTexts();
  const language = useLanguage(({ language }) => language);
  const { open, problem } = useRemote();
  const told = useRemote(({ told }) => (car === null ? undefined : told[car]));
  const others = told?.driver != null && !told.you.drives;
  const speed = told ? Math.round((told.speed / FULL_DUTY) * 100) : 0;
  return (
    <div className={css.notices}>
      <p className={css.state} role="status" data-state={told?.state}>
        {told ? t(told.state) : " "}
        {told?.state === "moving" && (
          <meter aria-label={t("speed")} min={0} max={100} value={speed}>
            {speed}
          </meter>
        )}
        {told?.battery_mv != null && (
          <span className={css.battery}>{t("battery", { volts: (told.battery_mv / 1000).toFixed(1) })}</span>
        )}
      </p>
      <div role="log">
        {!open && <p className={css.notice} data-wrong>{t("lostAbout")}</p>}
        {told?.why && <p className={css.notice} data-wrong>{told.why[language] ?? told.why.en}</p>}
        {told?.paused && (
          <p className={css.notice}>
            {t("paused")}
            <button type="button" className={buttons.button} onClick={() => link.start()}>
              {t("start")}
            </button>
          </p>
        )}
        {others && <p className={css.notice}>{told.you.waits ? t("waits") : t("othersDrive")}</p>}
        {told?.you.drives && told.wanted_by !== null && <p className={css.notice}>{t("wanted")}</p>}
        {told?.last_fault && <p className={css.notice} data-wrong>{t("fault", { fault: told.last_fault })}</p>}
        {problem && (
          <p className={css.notice} data-wrong>
            {problem[language] ?? problem.en}
            <button type="button" className={buttons.button} onClick={() => useRemote.setState({ problem: null })}>
              {t("dismiss")}
            </button>
          </p>
        )}
      </div>
    </div>
  );
}
