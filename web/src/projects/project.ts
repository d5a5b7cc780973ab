/** The open project: new ones, opening another in its place, and whether it is saved. */

import i18next from "i18next";
import type { OpenedProject, Project, WorkspaceState } from "../api/types";
import { confirm } from "../state/dialogs";
import { forgetEdits } from "../state/history";
import { useSettings } from "../state/settings";
import { EMPTY_MAT, type Studio, useStudio } from "../state/studio";
import { collectEdits } from "../words/compiling";

export const BLANK: OpenedProject = { name: "", leader: {}, followers: null, profile: "classroom", mat: EMPTY_MAT, range_mm: null };

const drive = (id: string, direction: string, seconds: number, next?: object) => ({
  type: "motorcade_drive",
  id,
  fields: { DIRECTION: direction, SPEED: "2", SECONDS: seconds },
  ...(next && { next: { block: next } }),
});

const firstTwo = (whose: string) => drive(`${whose}-forward`, "forward", 3, drive(`${whose}-left`, "left", 1));
const under = (hat: string, next: object, fields?: object): WorkspaceState => ({
  blocks: { languageVersion: 0, blocks: [{ type: hat, id: hat, x: 24, y: 24, ...(fields && { fields }), next: { block: next } }] },
});

/** Forward for three seconds, left for one: what a first look at the blocks shows. */
export const FIRST_STEPS: Pick<OpenedProject, "leader" | "followers"> = {
  leader: under("motorcade_leader", firstTwo("first")),
  followers: null,
};

/** The followers do the same, and pass the words on: the compiler gives such words tags. */
export const FIRST_SWARM: Pick<OpenedProject, "leader" | "followers"> = {
  leader: FIRST_STEPS.leader,
  followers: under("motorcade_followers", firstTwo("follow"), { ACCEPT_IR: true, FORWARD: true, TAGGED: "auto", DWELL: "auto" }),
};

const SAVED_PARTS = ["name", "leader", "followers", "python", "mat", "rangeMm"] as const;
type SavedParts = Pick<Studio, (typeof SAVED_PARTS)[number]>;
/** The project as a file or the library holds it; "nowhere" for one that came by a link or from autosave. */
let saved: SavedParts | "nowhere" | null = null;

export const sameProject = (a: SavedParts, b: SavedParts) => SAVED_PARTS.every((part) => a[part] === b[part]);

/** Compared as text, since edits that were undone make new objects with equal contents. */
const equalProjects = (a: SavedParts, b: SavedParts) =>
  SAVED_PARTS.every((part) => a[part] === b[part] || JSON.stringify(a[part]) === JSON.stringify(b[part]));

/** The open project as the server takes it, with the newest edits. */
export function openProject(): Project {
  collectEdits();
  const { leader, followers, profile, mat, rangeMm, python } = useStudio.getState();
  return { leader, followers, profile, mat, range_mm: rangeMm, python, level: useSettings.getState().level };
}

/** Fill page and editors with a project. */
export function loadProject(project: OpenedProject, parkedFollowers: WorkspaceState | null = null): void {
  forgetEdits();
  if (project.level) useSettings.setState({ level: project.level });
  useStudio.setState(({ generation }) => ({
    name: project.name ?? "",
    leader: project.leader,
    followers: project.followers,
    parkedFollowers,
    profile: project.profile,
    python: project.python ?? null,
    mat: project.mat ?? EMPTY_MAT,
    rangeMm: project.range_mm ?? null,
    mission: project.mission ?? null,
    compiled: null,
    selection: null,
    base: project.name && project.version ? { name: project.name, version: project.version } : null,
    editor: "leader",
    generation: generation + 1,
  }));
}

/**
 * Open another project in place of this one, once the user agrees to lose unsaved changes; false if they do not.
 * `stored`: a file or the library holds it. `kept`: what is replaced isn't lost, so nobody is asked.
 */
export async function replaceBy(project: OpenedProject, { stored = false, kept = false } = {}): Promise<boolean> {
  collectEdits();
  if (useStudio.getState().unsaved && !kept) {
    const agreed = await confirm({
      title: i18next.t("project.replaceTitle"),
      text: i18next.t("project.replaceText"),
      yes: i18next.t("project.replaceYes"),
    });
    if (!agreed) return false;
  }
  loadProject(project);
  // The editors are filled in the same turn; what they hold then is the saved project.
  setTimeout(() => {
    markSaved();
    useStudio.setState({ stored });
  });
  return true;
}

export function startNew(): Promise<boolean> {
  return replaceBy(BLANK);
}

export function markSaved(): void {
  collectEdits();
  saved = useStudio.getState();
  useStudio.setState({ unsaved: false });
}

export function watchUnsaved(): void {
  useStudio.subscribe((now, before) => {
    if (saved === null || sameProject(now, before)) return;
    const unsaved = saved === "nowhere" || !equalProjects(now, saved);
    if (unsaved !== now.unsaved) useStudio.setState({ unsaved });
  });
}

/** The open project is in no file: it was restored, or came by a link. */
export function markUnsaved(): void {
  saved = "nowhere";
  useStudio.setState({ unsaved: true });
}
