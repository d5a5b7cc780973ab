/** A mission for a teacher, on one page to be read or printed. */

import type { ReactNode } from "react";
import type { MissionNotes } from "../generated/messages";
import { inLanguage, useTexts } from "../i18n";
import { Choice } from "../ui/fields";
import { Picture } from "../mat/Picture";
import { useAnswer } from "../projects/useAnswer";
import { closeDialog, openNotes, useDialogs } from "../state/dialogs";
import { print, usePageState } from "../ui/panes";
import { Sheet, TextButton } from "../ui/controls";
import { playMission } from "./store";
import controls from "../ui/controls.module.css";
import css from "./missions.module.css";

function Part({ title, children }: { title: string; children: ReactNode }) {
  return (
    <section>
      <h3>{title}</h3>
      {children}
    </section>
  );
}

function Notes({ notes }: { notes: MissionNotes }) {
  const t = useTexts();
  const { minutes, aim, say, further } = notes;
  const place = t("missions.notes.place", {
    path: t(`missions.paths.${notes.path as "swarm"}`),
    number: notes.order,
    level: t(`level.${notes.level as "start"}`),
  });
  return (
    <article className={css.notes}>
      <div className={css.notesPicture}>
        <Picture mat={notes.mat} zones={notes.zones} />
      </div>
      <p className="quiet">
        {place}
        {minutes !== null && ` · ${t("missions.notes.minutes", { count: minutes })}`}
      </p>
      {aim && <Part title={t("missions.notes.aim")}>{inLanguage(aim)}</Part>}
      <Part title={t("missions.notes.task")}>{inLanguage(notes.story)}</Part>
      {say && <Part title={t("missions.notes.say")}>{inLanguage(say)}</Part>}
      <Part title={t("missions.goals")}>
        <ol>
          {notes.goals.map(({ star, text }, k) => (
            <li key={k}>
              {inLanguage(text)} <span className="quiet">{"★".repeat(star)}</span>
            </li>
          ))}
        </ol>
      </Part>
      {notes.mistakes.length > 0 && (
        <Part title={t("missions.notes.mistakes")}>
          <ul>
            {notes.mistakes.map(({ text, hint }, k) => (
              <li key={k}>
                {inLanguage(text)}
                {hint && <em> {t("missions.notes.helps", { hint: inLanguage(hint) })}</em>}
              </li>
            ))}
          </ul>
        </Part>
      )}
      <Part title={t("missions.notes.learned")}>{inLanguage(notes.learned)}</Part>
      {further && <Part title={t("missions.notes.further")}>{inLanguage(further)}</Part>}
    </article>
  );
}

/** The notes of one mission; another one is chosen above them. */
export function NotesDialog() {
  const t = useTexts();
  const wanted = useDialogs((state) => state.notesOf);
  const [missions] = useAnswer("missions", []);
  const id = wanted ?? missions[0]?.id;
  const [notes] = useAnswer("missions/notes", null, id ? { id } : null);
  usePageState("print", "sheet");
  return (
    <Sheet title={notes ? t("missions.notes.of", { name: inLanguage(notes.name) }) : t("missions.notes.title")} wide>
      {id && missions.length > 0 && (
        <div className="unprinted">
          <Choice
            label={t("missions.notes.which")}
            value={id}
            all={missions.map((each) => each.id)}
            name={(each) => inLanguage(missions.find((mission) => mission.id === each)!.name)}
            onChange={openNotes}
          />
        </div>
      )}
      {notes && <Notes notes={notes} />}
      {notes && (
        <footer className={controls.sheetFoot}>
          <TextButton onPress={() => void playMission({ id: notes.id }).then((opened) => opened && closeDialog())}>
            {t("missions.notes.play")}
          </TextButton>
          <TextButton primary onPress={print}>{t("missions.notes.print")}</TextButton>
        </footer>
      )}
    </Sheet>
  );
}
