/** A mission that is written on this page: its zones, goals and texts; the mat and the cars are the project's. */

import { create } from "zustand";
import { textOf } from "../api/fileText";
import { request } from "../api/service";
import { GOAL_KINDS } from "../generated/goals";
import type { Mission, MissionZone } from "../generated/messages";
import { boxOfZone } from "../mat/camera";
import { type Mat, type Point, rounded, without } from "../mat/document";
import { useMat } from "../mat/store";
import { attempt } from "../projects/actions";
import { chooseFile, download, fileName } from "../ui/files";
import { comeBack, openProject, replaceBy } from "../projects/project";
import { inLanguage, say } from "../i18n";
import { notify } from "../state/dialogs";
import { record } from "../state/history";
import { useStudio } from "../state/studio";
import { playMission } from "./store";

export type GoalKind = keyof typeof GOAL_KINDS;
export type DraftGoal = { kind: GoalKind; star: number } & Record<string, unknown>;

export interface Draft {
  name: string;
  story: string;
  seconds: number;
  zones: readonly MissionZone[];
  goals: readonly DraftGoal[];
  /** All other keys of the file. */
  others: Record<string, unknown>;
}

export const useDraft = create<{ draft: Draft | null }>(() => ({ draft: null }));

const FORMAT = "motorcade-mission/1";
const BLANK: Draft = { name: "", story: "", seconds: 20, zones: [], goals: [newGoal("in-zone")], others: {} };

/** Begin a mission on the project's mat. */
export function openDraft(): void {
  useStudio.setState({ mission: null });
  const { mat } = useStudio.getState();
  const [x, y] = middleOf(mat);
  useDraft.setState({ draft: { ...BLANK, zones: [boxAt("home", x + 0.5, y)], goals: [newGoal("in-zone", "home")] } });
}

/** Go on writing a mission of one's own, on its mat where another one is open. */
export function editMission(mission: Mission): void {
  const { name, story, seconds, zones, document } = mission;
  const others = without(document, "name", "story", "seconds", "zone", "goal", "mat", "format");
  const goals = document.goal as DraftGoal[];
  useStudio.setState({ mission: null, mat: mission.mat });
  useDraft.setState({ draft: { name: name.en, story: story.en, seconds, zones, goals, others } });
}

/** Stop writing; whoever came from a mission comes back to the own project. */
export function leaveDraft(): void {
  useDraft.setState({ draft: null });
  comeBack();
}

/** Change the draft. Edits with the same name one after another are undone together. */
export function editDraft(changes: Partial<Draft>, name: string | null = null): void {
  const { draft: before } = useDraft.getState();
  if (!before) return;
  const draft = { ...before, ...changes };
  const show = (shown: Draft) => () => {
    if (useDraft.getState().draft) useDraft.setState({ draft: shown });
  };
  useDraft.setState({ draft });
  record({ key: name && `mission ${name}`, undo: show(before), redo: show(draft) });
}

/** A goal of a kind with the values with which the editor begins. */
export function newGoal(kind: GoalKind, zone = ""): DraftGoal {
  const goal: DraftGoal = { kind, star: 1 };
  for (const field of GOAL_KINDS[kind]) {
    if (field.input === "zone") goal.zone = zone;
    else if ("first" in field) goal[field.name] = field.first;
  }
  return goal;
}

export function boxAt(name: string, x: number, y: number): MissionZone {
  const [left, right, bottom, top] = [x - 0.2, x + 0.2, y - 0.2, y + 0.2].map(rounded) as [number, number, number, number];
  const corners_m = [[left, bottom], [right, bottom], [right, top], [left, top]];
  return { name, title: { en: name, zh: name }, corners_m, centre_m: null, radius_m: null, avoid: false };
}

export function discAt(name: string, x: number, y: number): MissionZone {
  return { name, title: { en: name, zh: name }, corners_m: [], centre_m: [rounded(x), rounded(y)], radius_m: 0.2, avoid: false };
}

/** The zones, with those of which a goal keeps cars out marked. */
export function zonesOf({ zones, goals }: Draft): MissionZone[] {
  const isForbidding = ({ kind, at, from_s, until_s }: DraftGoal) => kind === "out-of-zone" && at === "always" && from_s === undefined && until_s === undefined;
  const avoided = goals.filter(isForbidding).map((goal) => goal.zone);
  return zones.map((zone) => ({ ...zone, avoid: avoided.includes(zone.name) }));
}

/** Left, bottom, width and height of a zone. */
export function boxOf(zone: MissionZone): [number, number, number, number] {
  const { left, bottom, right, top } = boxOfZone(zone);
  return [left, bottom, right - left, top - bottom];
}

/** Whether a part of a zone lies on the mat; a mat without a size has no end. */
export function touchesMat({ size_m }: Mat, zone: MissionZone): boolean {
  const [left, bottom, width, height] = boxOf(zone);
  return !size_m || (left < size_m[0] && bottom < size_m[1] && left + width > 0 && bottom + height > 0);
}

const SMALLEST_M = 0.05;

/** Move or stretch a zone; all its corners keep their places within it. */
export function reshapedZone(zone: MissionZone, changes: { left?: number; bottom?: number; width?: number; height?: number }): MissionZone {
  const [oldLeft, oldBottom, oldWidth, oldHeight] = boxOf(zone);
  const { left = oldLeft, bottom = oldBottom } = changes;
  const [width, height] = [Math.max(SMALLEST_M, changes.width ?? oldWidth), Math.max(SMALLEST_M, changes.height ?? oldHeight)];
  if (zone.centre_m) {
    const radius = rounded((changes.width ?? changes.height ?? oldWidth) / 2);
    return { ...zone, centre_m: [rounded(left + oldWidth / 2), rounded(bottom + oldHeight / 2)], radius_m: Math.max(SMALLEST_M, radius) };
  }
  const corner = ([x, y]: number[]): number[] => [
    rounded(left + ((x! - oldLeft) / oldWidth) * width),
    rounded(bottom + ((y! - oldBottom) / oldHeight) * height),
  ];
  return { ...zone, corners_m: zone.corners_m.map(corner) };
}

/** Bring the lower right corner of a zone, or the right edge of a disc, to a point; the upper left corner or the middle stays. */
export function stretchedZone(zone: MissionZone, [x, y]: Point): MissionZone {
  const [left, bottom, , height] = boxOf(zone);
  if (zone.centre_m) return reshapedZone(zone, { width: 2 * Math.max(x - zone.centre_m[0]!, zone.centre_m[1]! - y) });
  const tall = Math.max(SMALLEST_M, bottom + height - y);
  return reshapedZone(zone, { width: x - left, bottom: bottom + height - tall, height: tall });
}

/** The mission's file as a document. */
export function documentOf({ name, story, seconds, zones, goals, others }: Draft, mat: Mat): Record<string, unknown> {
  return {
    ...others,
    format: FORMAT,
    name: name.trim() || "…",
    ...(story.trim() && { story: story.trim() }),
    seconds,
    mat: without(mat as Record<string, unknown>, "format", "name"),
    zone: zones.map(({ name: zone, corners_m, centre_m, radius_m }) =>
      centre_m ? { name: zone, centre_m, radius_m } : { name: zone, corners_m },
    ),
    goal: goals,
  };
}

/** Play the draft with the blocks that stand here. */
export async function tryDraft(draft: Draft): Promise<void> {
  const { leader, followers } = openProject();
  if (await playMission({ document: documentOf(draft, useStudio.getState().mat) }, { leader, followers })) useDraft.setState({ draft: null });
}

export function saveDraft(draft: Draft): Promise<void> {
  return attempt(async () => {
    const { text } = await request("missions/save-text", { document: documentOf(draft, useStudio.getState().mat) });
    download(fileName(draft.name || "mission", ".mission.json"), text, "application/json");
  });
}

/** Save the draft in the library under its name, if it has one. */
export async function saveToLibrary(draft: Draft): Promise<void> {
  const name = draft.name.trim();
  if (!name) {
    notify(say("missions.nameless"), "warning");
    return;
  }
  await attempt(async () => {
    const { version } = await request("missions/write", { name, document: documentOf(draft, useStudio.getState().mat) });
    notify(say("missions.saved", { name, version }), "success");
  });
}

/** Play a mission of the library; false where it isn't there any more, or the user keeps what is open. */
export async function playOwn(name: string): Promise<boolean> {
  const mission = await attempt(() => request("missions/read", { name }));
  return mission !== undefined && playMission({ document: mission.document });
}

/** Change a mission of the library; false where it isn't there any more. */
export async function editOwn(name: string): Promise<boolean> {
  const changed = await attempt(async () => {
    const mission = await request("missions/read", { name });
    const { leader, followers, profile, mat } = mission;
    const opened = await replaceBy({ name: inLanguage(mission.name), leader, followers, profile, mat, range_mm: null });
    if (opened) editMission(mission);
    return opened;
  });
  return changed ?? false;
}

/** Play the mission in a file; false where none is chosen, or it isn't valid. */
export async function openMissionFile(): Promise<boolean> {
  const file = await chooseFile(".json,.toml,application/json");
  const mission = file && (await attempt(async () => request("missions/open", { text: await textOf(file) })));
  return Boolean(mission && (await playMission({ document: mission.document })));
}

/** Where the stage looks, or the middle of the mat. */
export function middleOf(mat: Mat): Point {
  const { scene } = useMat.getState();
  if (scene) return [rounded(scene.camera.x), rounded(scene.camera.y)];
  return mat.size_m ? [mat.size_m[0] / 2, mat.size_m[1] / 2] : [0, 0];
}
