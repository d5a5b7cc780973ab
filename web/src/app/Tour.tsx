import { useEffect, useState } from "react";
import { useTexts } from "../i18n";
import { useMat } from "../mat/store";
import { attempt } from "../projects/actions";
import { replaceBy, TOURED } from "../projects/project";
import { IconButton, TextButton } from "../ui/controls";
import { usePageState } from "../ui/panes";
import { type Studio, useStudio } from "../state/studio";
import { endTour, showTour, useTour } from "../state/tour";
import { GhostHand } from "./GhostHand";
import dialogs from "./dialogs.module.css";
import { classes } from "../ui/classes";

const STEPS = ["drag", "choose", "play"] as const;
type Step = (typeof STEPS)[number];
/** What the page lights up at each step. */
const PLACES = { welcome: "stage", drag: "blocks", choose: "blocks", play: "stage" } as const;

const hasBlock = ({ compiled }: Studio): boolean => (compiled?.follower_words ?? 0) > 0;
const turns = ({ followers }: Studio): boolean => /"DIRECTION":"(left|right)"/.test(JSON.stringify(followers));

/** The tour of a first visit: what drives there; then one drag, one choice and one Play by the user's own hand. */
export function Tour() {
  const shows = useTour((tour) => tour.shows);
  const isOpening = useStudio((studio) => studio.isOpening);
  // A mission says itself what is to be done.
  useEffect(() => useStudio.subscribe(({ mission }) => mission && endTour()), []);
  if (!shows) return null;
  return isOpening ? <Card step="welcome" onNext={begin} /> : <Steps />;
}

/** Begin with the tour's own page, unless there is work that its user doesn't want to lose. */
export function begin(): void {
  void attempt(async () => {
    if (!(await replaceBy(TOURED))) return;
    useStudio.setState({ editor: "followers" });
    showTour();
  });
}

/** What is to be done, one after another; a step that is done, or skipped, brings the next. */
function Steps() {
  const [skipped, setSkipped] = useState(0);
  const isBuilt = useStudio(hasBlock);
  // Without a block there is nothing to choose.
  const isChosen = useStudio((studio) => !hasBlock(studio) || turns(studio));
  const drives = useMat(({ state }) => state?.playing ?? false);
  const isDone = { drag: isBuilt, choose: isChosen, play: drives };
  const step = STEPS.find((name, at) => at >= skipped && !isDone[name]);
  useEffect(() => {
    if (!step) endTour();
  }, [step]);
  if (!step) return null;
  return (
    <>
      <Card step={step} onNext={() => setSkipped(STEPS.indexOf(step) + 1)} />
      <GhostHand key={step} step={step} />
    </>
  );
}

function Card({ step, onNext }: { step: Step | "welcome"; onNext: () => void }) {
  const t = useTexts();
  usePageState("tour", PLACES[step]);
  const isWelcome = step === "welcome";
  return (
    <aside className={classes("unprinted", dialogs.tour)} data-step={step} aria-labelledby="tour-title">
      <header className="row apart">
        <b id="tour-title">{t(`tour.${step}.title`)}</b>
        <IconButton icon="close" label={t("tour.skip")} onPress={endTour} />
      </header>
      <p aria-live="polite">{t(`tour.${step}.text`)}</p>
      <footer className="wrap apart nowrap">
        <span>{!isWelcome && t("tour.step", { at: STEPS.indexOf(step) + 1, of: STEPS.length })}</span>
        <TextButton primary={isWelcome} onPress={onNext}>{t(isWelcome ? "tour.welcome.next" : "tour.next")}</TextButton>
      </footer>
    </aside>
  );
}
