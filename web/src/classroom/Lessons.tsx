/** Three lessons of 45 minutes, each from missions: what comes when, and what to hand out. */

import type { ClassProgress } from "../generated/classroom";
import { inLanguage, useTexts } from "../i18n";
import { classes } from "../ui/classes";
import { Action } from "../ui/page";
import css from "./class.module.css";

/** By their number from 1, the missions in the order in which a class plays them; docs/first-lesson.md tells them in full. */
const LESSONS = [
  ["forward-and-stop", "round-the-corner"],
  ["follow-me", "close-enough", "pass-it-on"],
  ["red-light", "zebra-crossing", "home-on-the-dark"],
] as const;
const TEXTS = ["first", "second", "third"] as const;

interface LessonsProps {
  missions: ClassProgress["missions"];
  onHandOut: (id: string, name: string) => void;
}

export function Lessons({ missions, onHandOut }: LessonsProps) {
  const t = useTexts("class");
  return (
    <section aria-label={t("lessons")}>
      <h2>{t("lessons")}</h2>
      {TEXTS.map((lesson, k) => (
        <details key={lesson} className={classes("box", css.lesson)}>
          <summary>{t(`lesson.${lesson}`)}</summary>
          <ol>
            {t(`lesson.${lesson}Steps`)
              .split("\n")
              .map((step) => (
                <li key={step}>{step}</li>
              ))}
          </ol>
          <ul className="wrap">
            {missions
              .filter(({ id }) => (LESSONS[k] as readonly string[]).includes(id))
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
