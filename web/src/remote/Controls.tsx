import { useState } from "react";
import { Icon } from "../ui/icons";
import { link, pilot } from "./driving";
import { useRemote } from "./link";
import { useTexts } from "./texts";
import css from "./remote.module.css";
import buttons from "../ui/buttons.module.css";
import { classes } from "../ui/classes";

const LEAST_PERCENT = 20;
const FIRST_PERCENT = 60;
const STEP_PERCENT = 10;
pilot.limit = FIRST_PERCENT / 100;

function Limit() {
  const t = useTexts();
  const [percent, setPercent] = useState(FIRST_PERCENT);
  return (
    <label className={css.limit}>
      {t("limit", { percent })}
      <input
        type="range"
        min={LEAST_PERCENT}
        max={100}
        step={STEP_PERCENT}
        value={percent}
        onChange={(event) => {
          setPercent(Number(event.target.value));
          pilot.limit = Number(event.target.value) / 100;
        }}
      />
    </label>
  );
}

/** The emergency stop of all cars, in reach however far the page is scrolled. */
export function Stop() {
  const t = useTexts();
  return (
    <button type="button" className={css.stop} onClick={() => link.stopAll()}>
      {t("stop")}
      <kbd>{t("stopAbout")}</kbd>
    </button>
  );
}

/** What else can be asked of a car. */
export function Controls({ car }: { car: string | null }) {
  const t = useTexts();
  const told = useRemote(({ told }) => (car === null ? undefined : told[car]));
  const stopped = told?.state === "stopped";
  return (
    <div className={css.controls}>
      {car !== null && (
        <div className={css.asks}>
          {stopped && (
            <button type="button" className={classes(buttons.button, buttons.primary)} onClick={() => link.ask("clear", car)}>
              {t("clear")}
            </button>
          )}
          {told && !told.you.drives && told.driver !== null && !told.you.waits && (
            <button type="button" className={buttons.button} onClick={() => link.ask("request", car)}>
              {t("request")}
            </button>
          )}
          {(told?.you.drives ?? told?.you.waits) && (
            <button type="button" className={buttons.button} onClick={() => link.ask("release", car)}>
              {t("release")}
            </button>
          )}
          {told && !stopped && told.state !== "program" && told.state !== "away" && (
            <button type="button" className={buttons.button} onClick={() => link.ask("resume", car)}>
              <Icon name="blocks" />
              {t("resume")}
            </button>
          )}
        </div>
      )}
      <Limit />
    </div>
  );
}
