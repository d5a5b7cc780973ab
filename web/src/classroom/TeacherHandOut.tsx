/** What pupils are given: one of the teacher's projects, or a mission, path by path. */

import { lazy, Suspense, useEffect, useState } from "react";
import { post } from "../api/connection";
import type { ClassView } from "../generated/classroom";
import type { MissionEntry } from "../generated/messages";
import { inLanguage, type KeyIn, useTexts } from "../i18n";
import type { Picture as MatPicture } from "../mat/Picture";
import { confirm } from "../state/questions";
import { Action, Problem, Tick } from "../ui/page";
import { useAttempt } from "./attempt";
import { askTeacher } from "./ask";
import css from "./class.module.css";
import { Lessons } from "./Lessons";
import { useOwnProjects } from "./TeacherWork";

/** What draws is as large as the rest of the page: a mission shows its name before its picture, or without one. */
const Picture = lazy(async () => {
  const { Picture } = await import("../mat/Picture").catch((): { Picture: typeof MatPicture } => ({ Picture: () => <span /> }));
  return { default: Picture };
});

export function HandOutPart({ view }: { view: ClassView }) {
  const t = useTexts("class");
  const app = useTexts("app");
  const projects = useOwnProjects();
  const { problem, attempt } = useAttempt();
  const [missions, setMissions] = useState<MissionEntry[]>([]);
  const [to, setTo] = useState<readonly string[]>([]);
  const [done, setDone] = useState("");
  useEffect(() => {
    // Path by path and in order.
    void attempt(async () => setMissions((await post("/api/missions", {})) as MissionEntry[]));
    // eslint-disable-next-line react-hooks/exhaustive-deps
  }, []);
  const send = async (message: { name: string } | { mission: { id: string } }, what: string) => {
    const isForAll = to.length === 0;
    const text = t("mission" in message ? "handOutMissionAsk" : "handOutProjectAsk", { what, count: view.pupils.length });
    if (isForAll && !(await confirm({ title: t("handOut"), text, yes: t("handOut") }))) return;
    await attempt(async () => {
      const { pupils, missed } = await askTeacher("hand-out", { ...message, to: isForAll ? null : [...to] });
      const names = view.pupils.filter((pupil) => missed.includes(pupil.id)).map((pupil) => pupil.name);
      const failed = names.length > 0 ? ` ${t("notHandedOut", { names: names.join(", ") })}` : "";
      setDone(t("handedOut", { what, count: pupils }) + failed);
    });
  };
  const choose = (id: string, chosen: boolean) => setTo(chosen ? [...to, id] : to.filter((other) => other !== id));
  return (
    <section className={css.columns} aria-label={t("handOut")}>
      <fieldset className="box">
        <legend>{t("toWhom")}</legend>
        <Tick group="to" checked={to.length === 0} onChange={() => setTo([])}>
          {t("toAll")}
        </Tick>
        {view.pupils.map((pupil) => (
          <Tick key={pupil.id} checked={to.includes(pupil.id)} onChange={(chosen) => choose(pupil.id, chosen)}>
            {pupil.name}
          </Tick>
        ))}
      </fieldset>
      <div>
        <h2>{t("starters")}</h2>
        <p className="quiet small">
          {t("startersHint")} <a href="/" target="studio">{t("openStudio")}</a>
        </p>
        <ul className="wrap">
          {projects.map(({ name }) => (
            <li key={name}>
              <Action onClick={() => void send({ name }, name)}>{name}</Action>
            </li>
          ))}
        </ul>
        <Lessons missions={missions} onHandOut={(id, name) => void send({ mission: { id } }, name)} />
        {missions.length === 0 && problem === "" && <p className="quiet">{app("loading")}</p>}
        <Paths missions={missions} onGive={({ id, name }) => void send({ mission: { id } }, inLanguage(name))} />
        <div className={css.handedOut}>
          <p role="status">{done}</p>
          <Problem text={problem} />
        </div>
      </div>
    </section>
  );
}

/** Each path with its missions in the order in which they build on each other. */
function Paths({ missions, onGive }: { missions: readonly MissionEntry[]; onGive: (mission: MissionEntry) => void }) {
  const t = useTexts("missions");
  return [...new Set(missions.map(({ path }) => path))].map((path) => (
    <section key={path}>
      <h2>{t(`paths.${path}` as KeyIn<"missions">)}</h2>
      <ol className={css.missions}>
        {missions.filter((mission) => mission.path === path).map((mission) => (
          <Given key={mission.id} mission={mission} onGive={() => onGive(mission)} />
        ))}
      </ol>
    </section>
  ));
}

/** A mission to hand out: its picture, its place on the path, how long it takes. */
function Given({ mission: { id, name, order, mat, zones, stars, minutes }, onGive }: { mission: MissionEntry; onGive: () => void }) {
  const t = useTexts("class");
  return (
    <li className={css.mission}>
      <button type="button" className={css.give} data-mission={id} onClick={onGive}>
        <Suspense fallback={<span />}>
          <Picture mat={mat} zones={zones} />
        </Suspense>
        <b>
          {order}. {inLanguage(name)}
        </b>
      </button>
      <span className="row apart small">
        <span className="quiet">
          {minutes !== null && t("minutes", { count: minutes })} {"★".repeat(stars.length)}
        </span>
        <a href={`/#notes=${id}`} target="studio" aria-label={t("notesOf", { name: inLanguage(name) })}>
          {t("notes")}
        </a>
      </span>
    </li>
  );
}
