/** The real cars: the queue for the cable, the turns at driving, and the emergency stop. */

import { useState } from "react";
import type { ClassView } from "../generated/classroom";
import { askDesk } from "./ask";
import { Action, Problem, useAttempt } from "./Frame";
import css from "./class.module.css";
import { useTexts } from "./texts";

export function CarsPart({ view }: { view: ClassView }) {
  const t = useTexts();
  const { problem, attempt } = useAttempt();
  const [missed, setMissed] = useState<readonly string[]>([]);
  const nameOf = (id: string) => view.pupils.find((pupil) => pupil.id === id)?.name ?? id;
  const stop = () => attempt(async () => setMissed((await askDesk("stop-all")).missed));
  return (
    <section aria-label={t("cars")}>
      <div className={css.row}>
        {view.stopped ? (
          <Action onPress={() => void attempt(() => askDesk("release-all"))}>{t("releaseAll")}</Action>
        ) : (
          <Action danger onPress={() => void stop()}>
            {t("stopAll")}
          </Action>
        )}
        {view.stopped && <b role="status">{t("allStopped")}</b>}
      </div>
      {view.stopped && missed.length > 0 && <p className={css.problem}>{t("notReached", { cars: missed.join(", ") })}</p>}
      <Problem text={problem} />
      <h2>{t("cable")}</h2>
      {view.cable.length === 0 && <p className={css.quiet}>{t("cableFree")}</p>}
      <ol className={css.queue}>
        {view.cable.map((id, place) => (
          <li key={id}>
            {nameOf(id)} {place === 0 && <b>{t("hasCable")}</b>}
          </li>
        ))}
      </ol>
      {view.cable_use !== "free" && <p role="status">{t(view.cable_use === "ending" ? "cableEnding" : "cableSends")}</p>}
      {view.cable.length > 0 && <Action onPress={() => void attempt(() => askDesk("cable/next"))}>{t("nextOne")}</Action>}
      {view.turns.map((turn) => (
        <div key={turn.car}>
          <h2>{turn.car}</h2>
          <p>{turn.driver ? t("drives", { name: nameOf(turn.driver), count: turn.left_s }) : t("nobodyDrives")}</p>
          <ol className={css.queue}>
            {turn.waiting.map((id) => (
              <li key={id}>{nameOf(id)}</li>
            ))}
          </ol>
          {(turn.driver !== null || turn.waiting.length > 0) && (
            <Action onPress={() => void attempt(() => askDesk("turn/next", { car: turn.car, wants: true }))}>{t("nextOne")}</Action>
          )}
        </div>
      ))}
      {view.turns.length === 0 && <p className={css.quiet}>{t("noRealCars")}</p>}
    </section>
  );
}
