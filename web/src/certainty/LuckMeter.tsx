/** In how many other runs the program does what the mission asks for, and what went wrong in the rest. */

import { type CSSProperties, useEffect } from "react";
import { Button, Label, Meter } from "react-aria-components";
import { inLanguage, useTexts } from "../i18n";
import { useMat } from "../mat/store";
import { useDraft } from "../missions/draft";
import { useMission } from "../missions/store";
import { openDialog } from "../state/dialogs";
import { openDrawer } from "../state/settings";
import { useStudio } from "../state/studio";
import { playFrom, trials, useTrials } from "./trials";
import { TextButton } from "../ui/controls";
import css from "./certainty.module.css";

/** So many failures are told; they are much alike. */
const MOST_TOLD = 8;

/** A small bar with its number; nothing while nothing was tried. */
function LuckBar() {
  const t = useTexts();
  const luck = useTrials((now) => now.luck);
  if (!luck?.tried) return null;
  const { works, tried, of } = luck;
  const text = t("luck.works", { count: works, of: tried });
  return (
    <Meter className={css.meter} value={works} maxValue={tried} valueLabel={text} data-done={tried === of || undefined}>
      <Label>{text}</Label>
      <span className={css.bar} style={{ "--share": works / tried } as CSSProperties} />
    </Meter>
  );
}

/** The bar as a button, which shows more; nothing where luck plays no part: all runs end alike, and no goal asks for them. */
export function LuckButton() {
  const t = useTexts();
  const isAsked = useMission(({ mission }) => mission?.goals.some(({ kind }) => kind === "works") ?? false);
  const tells = useTrials(({ luck }) => luck !== null && luck.tried > 0 && (isAsked || ![0, luck.tried].includes(luck.works)));
  if (!tells) return null;
  return (
    <Button className={css.luck} aria-describedby="luck-more" onPress={() => openDrawer("sure")}>
      <LuckBar />
      <span id="luck-more" hidden>
        {t("luck.more")}
      </span>
    </Button>
  );
}

interface LuckProps {
  onCompare: (seed: number) => void;
}

/** The meter, and the runs that failed; one of them can be played. */
export function LuckPart({ onCompare }: LuckProps) {
  const t = useTexts();
  const { luck, problem } = useTrials();
  const hasGoal = useStudio(({ mission }) => mission !== null);
  const isWritten = useDraft(({ draft }) => draft !== null);
  const hasImage = useStudio(({ compiled }) => Boolean(compiled?.image));
  return (
    <section className={css.part} aria-label={t("luck.title")}>
      <h3>{t("luck.title")}</h3>
      {!hasGoal && !isWritten ? (
        <>
          <p>{t("luck.noGoal")}</p>
          <TextButton small onPress={() => openDialog("missions")}>{t("luck.missions")}</TextButton>
        </>
      ) : (
        <>
          <LuckBar />
          {!luck && <p className="quiet">{t("luck.how")}</p>}
          {!luck && (
            <TextButton small isDisabled={!hasImage} onPress={() => trials.begin()}>{t("luck.begin")}</TextButton>
          )}
          {problem && <p role="alert">{inLanguage(problem.sentence)}</p>}
          {luck && luck.tried === luck.of && luck.works === luck.of && <p>{t("luck.always")}</p>}
          {luck && <Failures failed={luck.failed} onCompare={onCompare} />}
        </>
      )}
    </section>
  );
}

function Failures({ failed, onCompare }: LuckProps & { failed: readonly number[] }) {
  const t = useTexts();
  const failures = useTrials((now) => now.failures);
  const usual = useMission(({ mission }) => mission?.seed);
  const seed = useMat((now) => now.seed);
  const told = failed.slice(0, MOST_TOLD);
  const asked = told.join();
  useEffect(() => {
    const known = useTrials.getState().failures;
    for (const each of asked ? asked.split(",").map(Number) : []) if (!known.has(each)) trials.send({ do: "explain", seed: each });
  }, [asked]);
  return (
    <>
      <ul className="column across" aria-label={t("luck.failed")}>
        {told.map((each) => {
          const failure = failures.get(each);
          return (
            <li key={each} className={css.failure}>
              <span>
                <b>{t("luck.run", { seed: each })}</b> {failure && inLanguage(failure.why)}
              </span>
              {failure && (
                <TextButton small onPress={() => playFrom(each, failure.t_ms, failure.cars)}>
                  {t("luck.play", { seconds: failure.t_ms / 1000 })}
                </TextButton>
              )}
              <TextButton small onPress={() => onCompare(each)}>{t("luck.compare")}</TextButton>
            </li>
          );
        })}
      </ul>
      {failed.length > MOST_TOLD && <p className="quiet">{t("luck.andMore", { count: failed.length - MOST_TOLD })}</p>}
      {usual !== undefined && seed !== usual && (
        <TextButton small onPress={() => playFrom(usual, 0, [])}>{t("luck.usual")}</TextButton>
      )}
    </>
  );
}
