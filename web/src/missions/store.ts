/** The mission that is played: opened in place of a project, its goals while the cars drive, and its stars. */

import { create } from "zustand";
import { request } from "../api/service";
import { inLanguage, say } from "../i18n";
import type { Mission, MissionChoice, MissionResult, Project } from "../generated/messages";
import { replay } from "../mat/replay";
import { choose, useMat } from "../mat/store";
import { attempt } from "../projects/actions";
import { comeBack, markUnsaved, openProject, putAside } from "../projects/project";
import { notify, openDialog } from "../state/dialogs";
import { confirm } from "../state/questions";
import { type Level, useSettings } from "../state/settings";
import { useStudio } from "../state/studio";

type Blocks = Pick<Project, "leader" | "followers">;

interface Playing {
  mission: Mission | null;
  /** How often a run has ended without all stars. */
  tries: number;
  /** How many hints are shown. */
  hints: number;
  result: MissionResult | null;
  /** Whether only the task's name shows, where the page is too small for task and blocks at once. */
  folded: boolean;
  /** Whether the story shows: who has tried once knows it, and the blocks need the room. */
  told: boolean;
  /** Whether a run has ended. */
  ended: boolean;
}

const NOTHING: Playing = { mission: null, tries: 0, hints: 0, result: null, folded: false, told: true, ended: false };
/** From this many tries on hints can be read. */
export const TRIES_BEFORE_HINTS = 2;

export const useMission = create<Playing>(() => NOTHING);

/** The mission as the server knows it: an id, or the document of the user's own. */
export function choiceOf(mission: Mission): MissionChoice {
  return mission.id === "own" ? { document: mission.document } : { id: mission.id };
}

/** What a mission's blocks are kept under when it is left. */
const keyOf = ({ id, name }: Mission): string => (id === "own" ? `own ${name.en}` : id);

/**
 * Open a mission; the user's own project is put aside as it stands. Each mission goes on with the blocks that it was left
 * with, unless it begins `anew`. With `blocks` these stay. False where it can't be opened, or the user doesn't want to lose
 * the blocks.
 */
export async function playMission(choice: MissionChoice, blocks: Blocks | null = null, anew = false): Promise<boolean> {
  const opened = await attempt(async () => {
    const mission = await request("mission", choice);
    const question = { title: say("missions.beginAnew"), text: say("missions.beginAnewText"), yes: say("missions.beginAnew") };
    if (anew && useStudio.getState().unsaved && !(await confirm(question))) return false;
    const before = blocks || anew ? undefined : useStudio.getState().attempts[keyOf(mission)];
    const { leader, followers } = blocks ?? before ?? mission;
    putAside({ name: inLanguage(mission.name), leader, followers, profile: mission.profile, mat: mission.mat, range_mm: null });
    useSettings.setState(({ drawer, level, levelBefore }) => ({
      level: mission.level as Level,
      levelBefore: levelBefore ?? level,
      // The task stands above the blocks: a drawer below would leave them no room.
      drawer: { ...drawer, open: false },
    }));
    useMission.setState({ ...NOTHING, mission });
    useMat.setState({ seed: mission.seed });
    useStudio.setState({ mission: choiceOf(mission) });
    if (!before) return true;
    setTimeout(markUnsaved);
    const { generation } = useStudio.getState();
    const action = { label: say("missions.beginAnew"), run: () => void playMission(choice, null, true) };
    notify(say("missions.goOn"), "info", action, (now) => now.generation === generation && now.mission !== null);
    return true;
  });
  return opened ?? false;
}

/** Go on with the mission that was played when the page was left; without it where there is none any more. */
export async function resumeMission(): Promise<void> {
  const choice = useStudio.getState().mission;
  if (!choice) {
    restoreLevel();
    return;
  }
  await attempt(async () => {
    const mission = await request("mission", choice);
    if (useStudio.getState().mission === choice) useMission.setState({ ...NOTHING, mission });
  });
  if (!useMission.getState().mission) {
    comeBack();
    restoreLevel();
  }
}

function restoreLevel(): void {
  useSettings.setState(({ level, levelBefore }) => ({ level: levelBefore ?? level, levelBefore: null }));
}

/** A run has ended: have the program checked on all seeds, and count the try. */
async function checkRun(mission: Mission): Promise<void> {
  const { leader, followers } = openProject();
  await attempt(async () => {
    const result = await request("missions/check", { mission: choiceOf(mission), leader, followers });
    if (useMission.getState().mission !== mission) return;
    const all = new Set(mission.goals.map(({ star }) => star));
    const { ended, tries: before } = useMission.getState();
    const tries = before + (result.stars.length < all.size ? 1 : 0);
    // Only the first end of a run folds the story; who shows it again keeps it.
    const told = ended && useMission.getState().told;
    useMission.setState({ result, tries, mission, told, ended: true });
  });
}

const hasEntry = () => (history.state as { mission?: boolean } | null)?.mission === true;

/** A mission has an entry of its own in the tab's history: 'Back' leads from it to the map. */
function followHistory(): void {
  const isPlayed = useMission.getState().mission !== null;
  if (isPlayed && !hasEntry()) history.pushState({ mission: true }, "");
  if (!isPlayed && hasEntry()) history.back();
}

function goBack(): void {
  if (useMission.getState().mission === null || hasEntry()) return;
  comeBack();
  openDialog("missions");
}

/** Follow the project and the world from now on. To be called once. */
export function watchMissions(): void {
  // One mission follows another in the same turn.
  useMission.subscribe(({ mission }, before) => mission !== before.mission && setTimeout(followHistory));
  window.addEventListener("popstate", goBack);
  useStudio.subscribe((now, before) => {
    const { mission } = useMission.getState();
    if (!mission) return;
    if (!now.mission) {
      useMission.setState(NOTHING);
      const { leader, followers, unsaved, stored, attempts } = before;
      // The changed blocks of a mission that is left are kept.
      if (unsaved || stored) useStudio.setState({ attempts: { ...attempts, [keyOf(mission)]: { leader, followers } } });
      restoreLevel();
    } else if (now.compiled?.image !== before.compiled?.image) useMission.setState({ result: null });
  });
  useMat.subscribe(({ goals, past }, { goals: before }) => {
    const { mission } = useMission.getState();
    // Not those of a past that is shown again.
    const isEnd = goals?.is_over && !before?.is_over && goals.goals.length > 0 && !past;
    if (mission && isEnd) void checkRun(mission);
  });
}

const BEFORE_MS = 2000;
const AFTER_MS = 500;

/** Play a moment of the run again, from just before; rings show which cars did not do what was asked. */
export function watchMoment(tMs: number, cars: readonly number[]): void {
  const [car] = cars;
  const endMs = useMat.getState().state?.t_ms ?? tMs;
  replay(tMs - BEFORE_MS, Math.min(tMs + AFTER_MS, endMs));
  choose(car === undefined ? null : { car });
  useMat.setState({ told: cars });
}
