/** The teacher's bar where a pupil's project is open: whose it is, and giving it back. */

import { useEffect, useState } from "react";
import { askTeacher } from "../classroom/ask";
import { useTexts } from "../i18n";
import { markSaved, openProject } from "../projects/project";
import { notify } from "../state/dialogs";
import { useStudio } from "../state/studio";
import areas from "../ui/areas.module.css";
import { classes } from "../ui/classes";
import css from "./pupil.module.css";
import { attemptInClass, looking } from "./store";
import { TextButton } from "../ui/controls";

export function TeacherBar() {
  const t = useTexts();
  const name = useStudio((studio) => studio.name.trim());
  const [shown] = useState(looking);
  const [who, setWho] = useState("");
  useEffect(() => {
    if (shown) void attemptInClass(async () => setWho((await askTeacher("library", { pupil: shown.pupil })).pupil));
  }, [shown]);
  if (!shown || !who) return null;
  const giveBack = () =>
    attemptInClass(async () => {
      const project = openProject();
      const sent = useStudio.getState();
      await askTeacher("hand-out", { to: [shown.pupil], name, project });
      markSaved(sent);
      notify(t("pupil.given", { name, to: who }), "success");
    });
  return (
    <section className={classes(areas.banner, css.bar)} aria-label={t("pupil.lookTitle")}>
      <b>{shown.project ? t("pupil.lookProject", { project: shown.project, name: who }) : t("pupil.lookDraft", { name: who })}</b>
      <span>{t("pupil.lookAbout")}</span>
      <TextButton small isDisabled={!name} onPress={() => void giveBack()}>{t("pupil.giveBack", { name: who })}</TextButton>
      {!name && <span>{t("pupil.giveNeedsName")}</span>}
    </section>
  );
}
