import { useEffect, useState } from "react";
import { Button } from "react-aria-components";
import { useTranslation } from "react-i18next";
import { FIRST_STEPS, loadProject } from "../projects/project";
import { IconButton } from "../ui/controls";
import { useSettings } from "../state/settings";
import { useStudio } from "../state/studio";
import dialogs from "./dialogs.module.css";
import buttons from "../ui/buttons.module.css";
import { classes } from "../ui/classes";

const STEPS = ["blocks", "words", "drive"] as const;

/** Add two blocks to an empty program, so that the tour has something to show. */
function provideSteps(): void {
  const studio = useStudio.getState();
  if ((studio.compiled?.states ?? 0) > 0) return;
  loadProject({ ...FIRST_STEPS, name: studio.name, profile: studio.profile, mat: studio.mat, range_mm: studio.rangeMm });
}

/** The tour of a first visit: build with blocks, look at the words, let the cars drive. */
export function Tour() {
  const { t } = useTranslation();
  const toured = useSettings((settings) => settings.toured);
  const [at, setAt] = useState(0);
  const step = STEPS[at]!;

  useEffect(() => {
    if (toured) return;
    document.documentElement.dataset.tour = step;
    return () => {
      delete document.documentElement.dataset.tour;
    };
  }, [step, toured]);

  if (toured) return null;
  const end = () => {
    useSettings.setState({ toured: true });
    setAt(0);
  };
  const next = () => {
    if (step === "blocks") provideSteps();
    if (step !== "drive") {
      setAt(at + 1);
      return;
    }
    document.getElementById("mat-play")?.click();
    end();
  };
  return (
    <aside className={dialogs.tour} aria-labelledby="tour-title">
      <header>
        <b id="tour-title">{t(`tour.${step}.title`)}</b>
        <IconButton icon="close" label={t("tour.skip")} onPress={end} />
      </header>
      <p aria-live="polite">{t(`tour.${step}.text`)}</p>
      <footer>
        <span>{t("tour.step", { at: at + 1, of: STEPS.length })}</span>
        <Button className={classes(buttons.button, buttons.primary)} onPress={next}>
          {t(`tour.${step}.next`)}
        </Button>
      </footer>
    </aside>
  );
}
