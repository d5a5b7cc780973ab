import { useEffect, useState } from "react";
import { alterBlocks } from "../blocks/rows";
import { useTexts } from "../i18n";
import { playWhenReady } from "../mat/actions";
import { BLANK, FIRST_STEPS, FIRST_SWARM, replaceBy } from "../projects/project";
import { IconButton, TextButton } from "../ui/controls";
import { useSettings } from "../state/settings";
import { useStudio } from "../state/studio";
import dialogs from "./dialogs.module.css";
import { classes } from "../ui/classes";

const STEPS = ["blocks", "followers", "drive"] as const;
/** What the page lights up at each step. */
const PLACES = { welcome: "stage", blocks: "blocks", followers: "blocks", drive: "stage" } as const;

/** Give blocks to whoever has none, so that the tour has something to show; undo takes them back. */
function first(): void {
  if ((useStudio.getState().compiled?.states ?? 0) === 0) alterBlocks(FIRST_STEPS.leader, FIRST_STEPS.followers);
}

/** Only where the leader's two blocks are the tour's own: other programs stay as they are. */
function swarm(): void {
  const { leader, followers } = useStudio.getState();
  if (followers === null && JSON.stringify(leader).includes("first-forward")) alterBlocks(FIRST_SWARM.leader, FIRST_SWARM.followers);
  if (useStudio.getState().followers !== null) useStudio.setState({ editor: "followers" });
}

/** What each step does; after the welcome the tour goes on with a page of its own. */
const ACTS = { welcome: () => void replaceBy(BLANK), blocks: first, followers: swarm, drive: playWhenReady };

/** The tour of a first visit: what drives there, then build with blocks, tell the followers, let the swarm drive. */
export function Tour() {
  const t = useTexts();
  const toured = useSettings((settings) => settings.toured);
  const [at, setAt] = useState(0);
  const isOpening = useStudio((studio) => studio.isOpening);
  const step = isOpening ? "welcome" : STEPS[at]!;

  useEffect(() => {
    if (toured) return;
    document.documentElement.dataset.tour = PLACES[step];
    return () => {
      delete document.documentElement.dataset.tour;
    };
  }, [step, toured]);

  const end = () => {
    useSettings.setState({ toured: true });
    setAt(0);
  };
  // A mission says itself what is to be done.
  useEffect(() => useStudio.subscribe(({ mission }) => mission && end()), []);

  if (toured) return null;
  const next = () => {
    ACTS[step]();
    if (step === "drive") end();
    else if (step !== "welcome") setAt(at + 1);
  };
  return (
    <aside className={classes("unprinted", dialogs.tour)} data-step={step} aria-labelledby="tour-title">
      <header className="row apart">
        <b id="tour-title">{t(`tour.${step}.title`)}</b>
        <IconButton icon="close" label={t("tour.skip")} onPress={end} />
      </header>
      <p aria-live="polite">{t(`tour.${step}.text`)}</p>
      <footer className="wrap apart">
        <span>{step !== "welcome" && t("tour.step", { at: at + 1, of: STEPS.length })}</span>
        <TextButton primary onPress={next}>{t(`tour.${step}.next`)}</TextButton>
      </footer>
    </aside>
  );
}
