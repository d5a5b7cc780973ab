/** Does it work? The luck meter, two runs side by side, and what the world stops on. */

import { useState } from "react";
import { useTexts } from "../i18n";
import { type Run, runNow } from "../mat/run";
import { useMission } from "../missions/store";
import { useStudio } from "../state/studio";
import { Comparison } from "./Comparison";
import { LuckPart } from "./LuckMeter";
import { StopList } from "./StopTools";
import { trials, useTrials } from "./trials";
import { TextButton } from "../ui/controls";
import css from "./certainty.module.css";

/** Without a mission two runs are compared for so long. */
const COMPARED_MS = 60_000;

export function CertaintyPanel() {
  const t = useTexts();
  const before = useTrials((now) => now.before);
  const image = useStudio(({ compiled }) => compiled?.image);
  const [names, setNames] = useState<readonly [string, string] | null>(null);
  const compare = (other: Run, name: string) => {
    const seconds = useMission.getState().mission?.seconds;
    trials.compare(runNow(), other, seconds ? seconds * 1000 : COMPARED_MS);
    setNames([t("compare.this"), name]);
  };
  const withSeed = (seed: number) => {
    const run = runNow();
    const usual = useMission.getState().mission?.seed;
    // The run of the page may be the one that failed.
    const other = seed === run.seed ? (usual !== undefined && usual !== seed ? usual : seed + 1) : seed;
    compare({ ...run, seed: other }, t("compare.luck", { seed: other }));
  };
  const close = () => {
    trials.endComparison();
    setNames(null);
  };
  return (
    <div className={css.panel}>
      <LuckPart onCompare={withSeed} />
      <div className={css.column}>
        <section className={css.part} aria-label={t("compare.title")}>
          <h3>{t("compare.title")}</h3>
          <p className="quiet">{t("compare.how")}</p>
          <TextButton small isDisabled={!image} onPress={() => withSeed((runNow().seed ?? 0) + 1)}>
            {t("compare.withLuck")}
          </TextButton>
          <TextButton
            small
            isDisabled={!image || !before || before.image === image}
            onPress={() => before && compare(before, t("compare.before"))}
          >
            {t("compare.withBefore")}
          </TextButton>
        </section>
        <StopList />
      </div>
      {names && <Comparison names={names} onClose={close} />}
    </div>
  );
}
