/** Where programs drive: the real cars, with their queues and the emergency stop, and the shared mat. */

import { useEffect, useState } from "react";
import type { ClassProgress, ClassView } from "../generated/classroom";
import { askTeacher } from "./ask";
import { Action, Problem, useAttempt } from "./Frame";
import css from "./class.module.css";
import { useSentences, useTexts } from "./texts";

/** What a pupil is called, by id. */
const namesIn = ({ pupils }: ClassView) => (id: string) => pupils.find((pupil) => pupil.id === id)?.name ?? id;

/** Pupils in their order. */
function Pupils({ ids, view, first }: { ids: readonly string[]; view: ClassView; first?: string }) {
  return (
    <ol className={css.queue}>
      {ids.map((id, place) => (
        <li key={id}>
          {namesIn(view)(id)} {place === 0 && first && <b>{first}</b>}
        </li>
      ))}
    </ol>
  );
}

export function CarsPart({ view }: { view: ClassView }) {
  const t = useTexts();
  const { problem, attempt } = useAttempt();
  const [missed, setMissed] = useState<readonly string[]>([]);
  const stop = () => attempt(async () => setMissed((await askTeacher("stop-all")).missed));
  return (
    <section aria-label={t("cars")}>
      <div className={css.row}>
        {view.stopped ? (
          <Action onPress={() => void attempt(() => askTeacher("release-all"))}>{t("releaseAll")}</Action>
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
      <Pupils ids={view.cable} view={view} first={t("hasCable")} />
      {view.cable_use !== "free" && <p role="status">{t(view.cable_use === "ending" ? "cableEnding" : "cableSends")}</p>}
      {view.cable.length > 0 && <Action onPress={() => void attempt(() => askTeacher("cable/next"))}>{t("nextOne")}</Action>}
      {view.turns.map((turn) => (
        <div key={turn.car}>
          <h2>{turn.car}</h2>
          <p>{turn.driver ? t("drives", { name: namesIn(view)(turn.driver), count: turn.left_s }) : t("nobodyDrives")}</p>
          <Pupils ids={turn.waiting} view={view} />
          {(turn.driver !== null || turn.waiting.length > 0) && (
            <Action onPress={() => void attempt(() => askTeacher("turn/next", { car: turn.car, wants: true }))}>{t("nextOne")}</Action>
          )}
        </div>
      ))}
      {view.turns.length === 0 && <p className={css.quiet}>{t("noRealCars")}</p>}
    </section>
  );
}

const MOST_FOLLOWERS = 10;
const FREE = "";

export function MatPart({ view }: { view: ClassView }) {
  const t = useTexts();
  const inLanguage = useSentences();
  const { problem, attempt } = useAttempt();
  const [missions, setMissions] = useState<ClassProgress["missions"]>([]);
  const [mission, setMission] = useState(FREE);
  const [followers, setFollowers] = useState(2);
  useEffect(() => void askTeacher("progress").then((progress) => setMissions(progress.missions), () => undefined), []);
  const { mat } = view;
  const open = () => askTeacher("mat/open", mission === FREE ? { followers } : { mission: { id: mission } });
  return (
    <section aria-label={t("mat")}>
      <p>{t("matAbout")}</p>
      {mat.state === "closed" ? (
        <div className={css.row}>
          <label>
            {t("matKind")}{" "}
            <select value={mission} onChange={(event) => setMission(event.target.value)}>
              <option value={FREE}>{t("matFree")}</option>
              {missions.map(({ id, name }) => (
                <option key={id} value={id}>
                  {inLanguage(name)}
                </option>
              ))}
            </select>
          </label>
          {mission === FREE && (
            <label>
              {t("followersEach")}{" "}
              <select value={followers} onChange={(event) => setFollowers(Number(event.target.value))}>
                {Array.from({ length: MOST_FOLLOWERS + 1 }, (_, count) => (
                  <option key={count}>{count}</option>
                ))}
              </select>
            </label>
          )}
          <Action primary onPress={() => void attempt(open)}>
            {t("matOpen")}
          </Action>
        </div>
      ) : (
        <>
          <p role="status">{t("matCollecting", { count: mat.entries.length, places: mat.places })}</p>
          <Pupils ids={mat.entries} view={view} />
          <div className={css.row}>
            {mat.state === "collecting" && (
              <Action primary disabled={mat.entries.length === 0} onPress={() => void attempt(() => askTeacher("mat/start"))}>
                {t("matStart")}
              </Action>
            )}
            <a className={css.linkButton} href="/mat" target="mat">
              {t("matShow")}
            </a>
            <Action onPress={() => void attempt(() => askTeacher("mat/close"))}>{t("matClose")}</Action>
          </div>
        </>
      )}
      <Problem text={problem} />
    </section>
  );
}
