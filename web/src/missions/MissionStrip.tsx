import { lazy, useEffect, useRef } from "react";
import { Button } from "react-aria-components";
import { focusBlocks, offerBlocks } from "../blocks/workspaces";
import type { CheckedGoal, GoalNow, Mission, MissionGoal, MissionResult } from "../generated/messages";
import { inLanguage, useLanguage, useTexts } from "../i18n";
import { playFrom, useTrials } from "../certainty/trials";
import { useMat } from "../mat/store";
import { comeBack } from "../projects/project";
import { openDialog } from "../state/dialogs";
import { IconButton, TextButton } from "../ui/controls";
import { classes } from "../ui/classes";
import { Later } from "../ui/panes";
import { BitEditor } from "./BitEditor";
import { editMission, useDraft, zonesOf } from "./draft";
import { MissionEditor } from "./MissionEditor";
import { Stars } from "./Stars";
import { playMission, TRIES_BEFORE_HINTS, useMission, watchMoment } from "./store";
import buttons from "../ui/buttons.module.css";
import css from "./missions.module.css";

const LuckButton = lazy(async () => ({ default: (await import("../certainty/LuckMeter")).LuckButton }));

/** What stands above the blocks: the mission that is played, or the one that is written; nothing otherwise. */
export function MissionStrip() {
  const mission = useMission((now) => now.mission);
  const draft = useDraft((now) => now.draft);
  const scene = useMat((now) => now.scene);
  const language = useLanguage();
  useEffect(() => scene?.setZones(mission?.zones ?? (draft ? zonesOf(draft) : []), mission !== null), [scene, mission, draft, language]);
  useEffect(() => offerBlocks(mission?.steps ?? null, mission?.edits === "bits"), [mission]);
  if (draft) return <MissionEditor draft={draft} />;
  return mission && <Task mission={mission} />;
}

function Task({ mission }: { mission: Mission }) {
  const t = useTexts();
  const goals = useMat((now) => now.goals);
  const { result, tries, hints, folded, told, ended } = useMission();
  const seed = useMat((now) => now.seed);
  const end = useEnd();
  const foldButton = useRef<HTMLButtonElement>(null);
  // The pressed button disappears, so the focus goes to what it has brought.
  const fold = (now: boolean) => {
    useMission.setState({ folded: now });
    requestAnimationFrame(() => (now ? focusBlocks() : foldButton.current?.focus()));
  };
  const moreHints = tries >= TRIES_BEFORE_HINTS && hints < mission.hints.length;
  return (
    <section
      className={css.strip}
      data-folded={folded || undefined}
      aria-label={t("missions.mission", { name: inLanguage(mission.name) })}
    >
      <header className={classes("wrap", css.head)}>
        <h2>{inLanguage(mission.name)}</h2>
        {end && (
          <span className={css.then}>
            {end.stars.length ? <Next mission={mission} /> : <TextButton small onPress={() => fold(false)}>{t("missions.showTask")}</TextButton>}
          </span>
        )}
        <Stars stars={starsOf(mission)} earned={result?.earned ?? mission.earned} />
        {!(end && !end.stars.length) && (
          <span className={css.unfold}>
            <IconButton icon="down" label={t("missions.showTask")} onPress={() => fold(false)} />
          </span>
        )}
        {ended && (
          <span className={css.story}>
            <IconButton
              icon={told ? "up" : "down"}
              label={t(told ? "missions.hideStory" : "missions.showStory")}
              aria-expanded={told}
              onPress={() => useMission.setState({ told: !told })}
            />
          </span>
        )}
        <span className={css.map}>
          <TextButton small onPress={() => openDialog("missions")}>{t("missions.map")}</TextButton>
        </span>
        {mission.id === "own" && (
          <span className={css.edit}>
            <TextButton small onPress={() => editMission(mission)}>{t("missions.edit")}</TextButton>
          </span>
        )}
        <IconButton icon="close" label={t("missions.leave")} onPress={comeBack} />
      </header>
      <div role="status" className={css.outcome}>
        {result ? <Outcome mission={mission} result={result} /> : <Foretold of={starsOf(mission).length} />}
      </div>
      {told && <p>{inLanguage(mission.story)}</p>}
      {mission.edits === "bits" && <BitEditor />}
      <ul className={classes("stack tight", css.goals)} aria-label={t("missions.goals")}>
        {mission.goals.map((goal, k) => (
          <GoalLine
            key={k}
            goal={goal}
            now={goals?.goals[k]}
            checked={result?.goals[k]}
            isEarned={result?.stars.includes(goal.star) ?? false}
            seed={seed}
          />
        ))}
      </ul>
      {tries > 0 && (
        <Later>
          <LuckButton />
        </Later>
      )}
      <div role="status" className={css.outcome}>
        {mission.hints.slice(0, hints).map((hint, k) => (
          <p key={k} className="caution">
            {t("missions.hint", { number: k + 1 })} {inLanguage(hint)}
          </p>
        ))}
      </div>
      {moreHints && (
        <TextButton small onPress={() => useMission.setState({ hints: hints + 1 })}>{t("missions.showHint")}</TextButton>
      )}
      <Button ref={foldButton} className={classes(buttons.button, buttons.primary, css.fold)} onPress={() => fold(true)}>
        {t("missions.toBlocks")}
      </Button>
    </section>
  );
}

interface GoalLineProps {
  goal: MissionGoal;
  now: GoalNow | undefined;
  checked: CheckedGoal | undefined;
  /** Whether the last run has earned its star. */
  isEarned: boolean;
  /** The seed that the page plays. */
  seed: number;
}

const MARKS = { open: "○", holds: "◐", met: "✓", lost: "✗" } as const;

/** A goal with its tick, and, where it is lost, what happened; a button plays that moment from just before. */
function GoalLine({ goal, now, checked, isEarned, seed }: GoalLineProps) {
  const t = useTexts();
  const progress = checked ? (checked.met ? "met" : "lost") : (now?.progress ?? "open");
  const lost = progress === "lost" ? (checked ?? now) : undefined;
  const other = checked && checked.seed !== seed ? checked.seed : null;
  const watch = (tMs: number, cars: readonly number[]) => (other === null ? watchMoment(tMs, cars) : playFrom(other, tMs, cars));
  return (
    <li data-progress={progress}>
      <span className={css.mark} role="img" aria-label={t(`missions.progress.${progress}`)}>
        {MARKS[progress]}
      </span>
      <span>
        {inLanguage(goal.text)}{" "}
        <span className={isEarned ? css.earned : "quiet"}>
          {(isEarned ? "★" : "☆").repeat(goal.star)}
        </span>
        {lost && (
          <span className={classes("wrap quiet", css.why)}>
            <span>{inLanguage(lost.why)}</span>
            {other !== null && <span>{t("missions.otherLuck")}</span>}
            {lost.t_ms ? <TextButton small onPress={() => watch(lost.t_ms!, lost.cars)}>{t("missions.watch")}</TextButton> : null}
          </span>
        )}
      </span>
    </li>
  );
}

/** The result of a run that is over; null while the cars drive, and once somebody looks back. */
function useEnd(): MissionResult | null {
  const isOver = useMat(({ goals, past }) => (goals?.is_over ?? false) && !past);
  const result = useMission((now) => now.result);
  return isOver ? result : null;
}

/** How a run ended, on the stage of a phone: the blocks have the task's room, and its head says how to go on. */
export function OutcomeOnStage() {
  const { mission, folded } = useMission();
  const end = useEnd();
  if (!mission || !end || !folded) return null;
  return (
    <div role="status" className={css.onStage}>
      <Outcome mission={mission} result={end} onStage />
    </div>
  );
}

const starsOf = ({ goals }: Mission) => [...new Set(goals.map(({ star }) => star))].sort();

/** While the cars drive: the stars that the program earns on all seeds of the mission. */
function Foretold({ of }: { of: number }) {
  const t = useTexts();
  const earned = useTrials(({ luck }) => luck?.stars);
  const plays = useMat(({ state }) => state?.playing);
  return plays && earned ? <p>{t("missions.foretold", { stars: earned.length, of })}</p> : null;
}

/** The stars of the last run, and what was learned; or the usual mistake that was made. On the stage that alone. */
function Outcome({ mission, result, onStage = false }: { mission: Mission; result: MissionResult; onStage?: boolean }) {
  const t = useTexts();
  if (result.steps) return <p>{inLanguage(result.steps)}</p>;
  if (!result.stars.length) {
    const { mistake } = result;
    return <p className="strong">{mistake ? t("missions.mistake", { mistake: inLanguage(mistake) }) : t("missions.again")}</p>;
  }
  return (
    <>
      <p className="strong">
        <Stars stars={starsOf(mission)} earned={result.stars} /> {inLanguage(mission.learned)}
      </p>
      {!onStage && (
        <div className="wrap">
          <Next mission={mission} />
          <TextButton small onPress={() => openDialog("run")}>{t("run.open")}</TextButton>
        </div>
      )}
    </>
  );
}

function Next({ mission }: { mission: Mission }) {
  const t = useTexts();
  const next = () => (mission.next ? void playMission({ id: mission.next }) : openDialog("missions"));
  return <TextButton small primary onPress={next}>{t(mission.next ? "missions.next" : "missions.choose")}</TextButton>;
}
