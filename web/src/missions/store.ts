/** The mission that is played: opened in place of a project, its goals while the cars drive, and its stars. */

import i18next from "i18next";
import { create } from "zustand";
import * as api from "../api/requests";
import { inLanguage } from "../i18n";
import type { Goals, Mission, MissionChoice, MissionResult, Project } from "../generated/messages";
import { drivesLike, type Mat } from "../mat/document";
import { useMat } from "../mat/store";
import { attempt } from "../projects/actions";
import { loadProject, markUnsaved, openProject, replaceBy } from "../projects/project";
import { notify } from "../state/dialogs";
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

/** The blocks with which missions that come with Motorcade were left for another one, by id, until the page is closed. */
const attempts = new Map<string, Blocks>();

/** The mission as the server knows it: an id, or the document of the user's own. */
export function choiceOf(mission: Mission): MissionChoice {
  return mission.id === "own" ? { document: mission.document } : { id: mission.id };
}

/** Keep the changed blocks of the mission that is left for another one; false where they aren't kept. */
function keepAttempt(next: Mission): boolean {
  const { mission } = useMission.getState();
  const { leader, followers } = openProject();
  if (!mission || mission.id === "own" || mission.id === next.id || !useStudio.getState().unsaved) return false;
  attempts.set(mission.id, { leader, followers });
  return true;
}

/**
 * Open a mission in place of the project, once the user agrees to lose unsaved changes; false if they do not.
 * With `blocks` these stay, and nothing is lost. From one mission to another nothing is lost either: each goes on with the
 * blocks that it was left with.
 */
export async function playMission(choice: MissionChoice, blocks: Blocks | null = null): Promise<boolean> {
  let opened = false;
  await attempt(async () => {
    const mission = await api.mission(choice);
    const kept = !blocks && keepAttempt(mission);
    const before = blocks ? undefined : attempts.get(mission.id);
    const { leader, followers } = blocks ?? before ?? mission;
    const project = { name: inLanguage(mission.name), leader, followers, profile: mission.profile, mat: mission.mat as Mat, range_mm: null };
    if (blocks) loadProject(project);
    else if (!(await replaceBy(project, { kept }))) return;
    opened = true;
    attempts.delete(mission.id);
    useSettings.setState(({ drawer, level, levelBefore }) => ({
      level: mission.level as Level,
      levelBefore: levelBefore ?? level,
      // The task stands above the blocks: a drawer below would leave them no room.
      drawer: { ...drawer, open: false },
    }));
    useMission.setState({ ...NOTHING, mission });
    useStudio.setState({ mission: choiceOf(mission) });
    if (!before) return;
    setTimeout(markUnsaved);
    const { generation } = useStudio.getState();
    const action = { label: i18next.t("missions.beginAnew"), run: () => void playMission(choice) };
    notify(i18next.t("missions.goOn"), "info", action, (now) => now.generation === generation && now.mission !== null);
  });
  return opened;
}

/** Go on with the mission that was played when the page was left; without it where there is none any more. */
export async function resumeMission(): Promise<void> {
  const choice = useStudio.getState().mission;
  if (!choice) {
    restoreLevel();
    return;
  }
  await attempt(async () => {
    const mission = await api.mission(choice);
    if (useStudio.getState().mission === choice) useMission.setState({ ...NOTHING, mission });
  });
  if (!useMission.getState().mission) {
    leaveMission();
    restoreLevel();
  }
}

function restoreLevel(): void {
  useSettings.setState(({ level, levelBefore }) => ({ level: levelBefore ?? level, levelBefore: null }));
}

/** Go on with the blocks as a project of one's own. */
export function leaveMission(): void {
  useStudio.setState({ mission: null });
}

/** A run has ended: have the program checked on all seeds, and count the try. */
async function checkRun(mission: Mission): Promise<void> {
  const { leader, followers } = openProject();
  await attempt(async () => {
    const result = await api.checkMission({ mission: choiceOf(mission), leader, followers });
    if (useMission.getState().mission !== mission) return;
    const all = new Set(mission.goals.map(({ star }) => star));
    const { ended, tries: before } = useMission.getState();
    const tries = before + (result.stars.length < all.size ? 1 : 0);
    // Only the first end of a run folds the story; who shows it again keeps it.
    const told = ended && useMission.getState().told;
    useMission.setState({ result, tries, mission, folded: false, told, ended: true });
  });
}

/** Follow the project and the world from now on. To be called once. */
export function watchMissions(): void {
  useStudio.subscribe((now, before) => {
    const { mission } = useMission.getState();
    if (!mission) return;
    if (!now.mission) {
      useMission.setState(NOTHING);
      restoreLevel();
    } else if (now.mat !== before.mat && !drivesLike(now.mat, mission.mat)) {
      // Stars are earned on the mission's own mat.
      useStudio.setState({ mat: mission.mat });
      notify(i18next.t("missions.matStays"));
    } else if (now.compiled?.image !== before.compiled?.image) useMission.setState({ result: null });
  });
  useMat.subscribe(({ goals }, { goals: before }) => {
    const { mission } = useMission.getState();
    if (mission && goals?.is_over && !before?.is_over && isPresent(goals)) void checkRun(mission);
  });
}

/** Whether these are the goals of a run that has just ended, and not those of a past that is shown again. */
function isPresent(goals: Goals): boolean {
  return goals.goals.length > 0 && !useMat.getState().past;
}
