/** One project is open at a time: taking another, knowing whether it is saved, and saving it of itself. */

import i18next from "i18next";
import type { OpenedProject, Project, WorkspaceState } from "../api/types";
import { confirmed } from "../app/asking";
import { useStudio, type Studio } from "../app/store";
import { flush } from "../words/compiling";
import { BLANK, EMPTY_MAT } from "./blank";

const snapshot = ({ name, leader, followers, mat, rangeMm }: Studio) =>
  JSON.stringify([name, leader, followers, mat, rangeMm]);
/** The project as some file or library holds it; null while none does. */
let savedSnapshot: string | null = null;

/** The open project as the server takes it, with the very newest edits. */
export function openProject(): Project {
  flush();
  const { leader, followers, profile, mat, rangeMm } = useStudio.getState();
  return { leader, followers, profile, mat, range_mm: rangeMm };
}

export function take(project: OpenedProject, parkedFollowers: WorkspaceState | null = null): void {
  useStudio.setState(({ generation }) => ({
    name: project.name ?? "",
    leader: project.leader,
    followers: project.followers,
    parkedFollowers,
    profile: project.profile,
    mat: project.mat ?? EMPTY_MAT,
    rangeMm: project.range_mm ?? null,
    compiled: null,
    selection: null,
    generation: generation + 1,
  }));
}

/** Takes another project in place of this one, once the user agrees to lose what isn't saved. */
export async function replaceBy(project: OpenedProject): Promise<boolean> {
  flush();
  if (useStudio.getState().unsaved) {
    const agreed = await confirmed({
      title: i18next.t("project.replaceTitle"),
      text: i18next.t("project.replaceText"),
      yes: i18next.t("project.replaceYes"),
    });
    if (!agreed) return false;
  }
  take(project);
  // The editors fill themselves in the same turn; what they then hold is the saved project.
  setTimeout(markSaved);
  return true;
}

export function startNew(): Promise<boolean> {
  return replaceBy(BLANK);
}

export function markSaved(): void {
  flush();
  savedSnapshot = snapshot(useStudio.getState());
  useStudio.setState({ unsaved: false });
}

export function watchUnsaved(): void {
  useStudio.subscribe((now, before) => {
    const same =
      now.leader === before.leader &&
      now.followers === before.followers &&
      now.mat === before.mat &&
      now.rangeMm === before.rangeMm &&
      now.name === before.name;
    if (same) return;
    const unsaved = savedSnapshot !== null && snapshot(now) !== savedSnapshot;
    if (unsaved !== now.unsaved) useStudio.setState({ unsaved });
  });
}

/** What is open stands in no file: restored work, or what came by a link. */
export function markUnsaved(): void {
  savedSnapshot = "";
  useStudio.setState({ unsaved: true });
}
