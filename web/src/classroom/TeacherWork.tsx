/** What the class works on: the stars of all missions, and what is handed out. */

import { useEffect, useState } from "react";
import type { ClassProgress, ClassView } from "../generated/classroom";
import { post } from "../api/connection";
import type { LibraryEntry } from "../generated/messages";
import { inLanguage, useTexts } from "../i18n";
import { Action, Problem, Tick } from "../ui/page";
import { useAttempt } from "./attempt";
import { askTeacher } from "./ask";
import { Avatar } from "./Avatar";
import css from "./class.module.css";
import { Lessons } from "./Lessons";
import { Report } from "./TeacherCheck";

const LOOK_EVERY_MS = 5000;

/** The missions' stars of all pupils, read again from time to time. */
function useProgress(): ClassProgress | null {
  const [progress, setProgress] = useState<ClassProgress | null>(null);
  useEffect(() => {
    const look = () => void askTeacher("progress").then(setProgress, () => undefined);
    look();
    const timer = setInterval(look, LOOK_EVERY_MS);
    return () => clearInterval(timer);
  }, []);
  return progress;
}

export function ProgressPart({ view }: { view: ClassView }) {
  const t = useTexts("class");
  const progress = useProgress();
  if (!progress) return null;
  return (
    <>
    <div className={css.scroller} tabIndex={0} role="region" aria-label={t("progress")}>
      <table className={css.progress}>
        <thead>
          <tr>
            <th scope="col">{t("pupils")}</th>
            {progress.missions.map((mission) => (
              <th key={mission.id} scope="col">
                <span>{inLanguage(mission.name)}</span>
              </th>
            ))}
          </tr>
        </thead>
        <tbody>
          {view.pupils.map((pupil) => (
            <tr key={pupil.id}>
              <th scope="row">
                <Avatar name={pupil.avatar} /> {pupil.name}
              </th>
              {progress.missions.map((mission) => {
                const count = progress.stars[pupil.id]?.[mission.id]?.length ?? 0;
                return (
                  <td key={mission.id} data-now={pupil.mission === mission.id || undefined} aria-label={t("starsCount", { count })}>
                    {"★".repeat(count)}
                  </td>
                );
              })}
            </tr>
          ))}
        </tbody>
      </table>
    </div>
    <Report missions={progress.missions} />
    </>
  );
}

/** The projects in the teacher's own library. */
export function useOwnProjects(): LibraryEntry[] {
  const [projects, setProjects] = useState<LibraryEntry[]>([]);
  useEffect(() => void post("/api/projects/list", null).then((found) => setProjects(found as LibraryEntry[]), () => undefined), []);
  return projects;
}

export function HandOutPart({ view }: { view: ClassView }) {
  const t = useTexts("class");
  const progress = useProgress();
  const projects = useOwnProjects();
  const { problem, attempt } = useAttempt();
  const [to, setTo] = useState<readonly string[]>([]);
  const [done, setDone] = useState("");
  const send = (message: { name: string } | { mission: { id: string } }, what: string) =>
    attempt(async () => {
      const { pupils, missed } = await askTeacher("hand-out", { ...message, to: to.length > 0 ? [...to] : null });
      const names = view.pupils.filter((pupil) => missed.includes(pupil.id)).map((pupil) => pupil.name);
      const failed = names.length > 0 ? ` ${t("notHandedOut", { names: names.join(", ") })}` : "";
      setDone(t("handedOut", { what, count: pupils }) + failed);
    });
  const choose = (id: string, chosen: boolean) => setTo(chosen ? [...to, id] : to.filter((each) => each !== id));
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
        <Lessons missions={progress?.missions ?? []} onHandOut={(id, name) => void send({ mission: { id } }, name)} />
        <h2>{t("missions")}</h2>
        <ul className="wrap">
          {progress?.missions.map(({ id, name }) => (
            <li key={id}>
              <Action onClick={() => void send({ mission: { id } }, inLanguage(name))}>{inLanguage(name)}</Action>{" "}
              <a href={`/#notes=${id}`} target="studio" aria-label={t("notesOf", { name: inLanguage(name) })}>
                {t("notes")}
              </a>
            </li>
          ))}
        </ul>
        <p role="status">{done}</p>
        <Problem text={problem} />
      </div>
    </section>
  );
}
