/** What the class works on: the stars of all missions, and the teacher's own projects. */

import { useEffect, useState } from "react";
import type { ClassProgress, ClassView } from "../generated/classroom";
import { post } from "../api/connection";
import type { LibraryEntry } from "../generated/messages";
import { inLanguage, useTexts } from "../i18n";
import { askTeacher } from "./ask";
import { Avatar } from "./Avatar";
import css from "./class.module.css";
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
