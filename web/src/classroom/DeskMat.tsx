/** The shared mat: open it, see whose programs are there, start them together. */

import { useEffect, useState } from "react";
import type { ClassProgress, ClassView } from "../generated/classroom";
import { askDesk } from "./ask";
import { Action, Problem, useAttempt } from "./Frame";
import css from "./class.module.css";
import { useSentences, useTexts } from "./texts";

const MOST_FOLLOWERS = 10;
const FREE = "";

export function MatPart({ view }: { view: ClassView }) {
  const t = useTexts();
  const inLanguage = useSentences();
  const { problem, attempt } = useAttempt();
  const [missions, setMissions] = useState<ClassProgress["missions"]>([]);
  const [mission, setMission] = useState(FREE);
  const [followers, setFollowers] = useState(2);
  useEffect(() => void askDesk("progress").then((progress) => setMissions(progress.missions), () => undefined), []);
  const { mat } = view;
  const nameOf = (id: string) => view.pupils.find((pupil) => pupil.id === id)?.name ?? id;
  const open = () => askDesk("mat/open", mission === FREE ? { followers } : { mission: { id: mission } });
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
          <ol className={css.queue}>
            {mat.entries.map((id) => (
              <li key={id}>{nameOf(id)}</li>
            ))}
          </ol>
          <div className={css.row}>
            {mat.state === "collecting" && (
              <Action primary disabled={mat.entries.length === 0} onPress={() => void attempt(() => askDesk("mat/start"))}>
                {t("matStart")}
              </Action>
            )}
            <a className={css.linkButton} href="/mat" target="mat">
              {t("matShow")}
            </a>
            <Action onPress={() => void attempt(() => askDesk("mat/close"))}>{t("matClose")}</Action>
          </div>
        </>
      )}
      <Problem text={problem} />
    </section>
  );
}
