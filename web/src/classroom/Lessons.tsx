/** Three lessons of 45 minutes, each from missions: what comes when, and what to hand out. */

import type { MissionEntry } from "../generated/messages";
import { inLanguage, useTexts } from "../i18n";
import { classes } from "../ui/classes";
import { Action } from "../ui/page";
import css from "./class.module.css";

/** The missions in the order in which a class plays them; docs/first-lesson.md and the two others tell the lessons in full. */
const LESSONS = [
  { title: "lesson.first", steps: "lesson.firstSteps", missions: ["forward-and-stop", "round-the-corner"] },
  { title: "lesson.second", steps: "lesson.secondSteps", missions: ["follow-me", "close-enough", "pass-it-on"] },
  { title: "lesson.third", steps: "lesson.thirdSteps", missions: ["red-light", "zebra-crossing", "home-on-the-dark"] },
] as const;

interface LessonsProps {
  missions: readonly MissionEntry[];
  onHandOut: (id: string, name: string) => void;
}

export function Lessons({ missions, onHandOut }: LessonsProps) {
  const t = useTexts("class");
  return (
    <section aria-label={t("lessons")}>
      <h2>{t("lessons")}</h2>
      {LESSONS.map((lesson) => (
        <details key={lesson.title} className={classes("box", css.lesson)}>
          <summary>{t(lesson.title)}</summary>
          <ol>
            {t(lesson.steps)
              .split("\n")
              .map((step) => (
                <li key={step}>{step}</li>
              ))}
          </ol>
          <ul className="wrap">
            {missions
              .filter(({ id }) => (lesson.missions as readonly string[]).includes(id))
              .map(({ id, name }) => (
                <li key={id}>
                  <Action onClick={() => onHandOut(id, inLanguage(name))}>{inLanguage(name)}</Action>{" "}
                  <a href={`/#notes=${id}`} target="studio" aria-label={t("notesOf", { name: inLanguage(name) })}>
                    {t("notes")}
                  </a>
                </li>
              ))}
          </ul>
        </details>
      ))}
    </section>
  );
}
