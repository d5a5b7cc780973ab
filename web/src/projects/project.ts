/** The open project: new ones, opening another in its place, and whether it is saved. */

import { RefusedError, request } from "../api/service";
import type { MeasuredCar, OpenedProject, Project, WorkspaceState } from "../api/types";
import { EMPTY_FOLLOWERS } from "../blocks/workspaces";
import type { SavedVersion } from "../generated/messages";
import { inLanguage, say } from "../i18n";
import { session } from "../mat/session";
import { isFixed } from "../mat/store";
import { notify } from "../state/dialogs";
import { ask, confirm } from "../state/questions";
import { endEdit, forgetEdits, record } from "../state/history";
import { useSettings } from "../state/settings";
import { EMPTY_MAT, ownProject, type Studio, useStudio } from "../state/studio";
import { collectEdits } from "../words/compiling";

export const BLANK: OpenedProject = { name: "", leader: {}, followers: null, profile: "classroom", mat: EMPTY_MAT, range_mm: null };

/** What the tour begins with: followers that have no blocks yet, and pass on what they hear. */
export const TOURED: OpenedProject = { ...BLANK, followers: EMPTY_FOLLOWERS };

const SAVED_PARTS = ["name", "leader", "followers", "python", "profile", "mat", "rangeMm", "car"] as const;
type SavedParts = Pick<Studio, (typeof SAVED_PARTS)[number]>;

export const sameProject = (a: SavedParts, b: SavedParts) => SAVED_PARTS.every((part) => a[part] === b[part]);

/** Compared as text, since edits that were undone make new objects with equal contents. */
const equalProjects = (a: SavedParts, b: SavedParts) =>
  SAVED_PARTS.every((part) => a[part] === b[part] || JSON.stringify(a[part]) === JSON.stringify(b[part]));

/** The open project as the server takes it, with the newest edits. */
export function openProject(): Project {
  collectEdits();
  const { leader, followers, profile, mat, rangeMm, car, python } = useStudio.getState();
  return { leader, followers, profile, mat, range_mm: rangeMm, car, python, level: useSettings.getState().level };
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
    car: project.car ?? null,
    mission: project.mission ?? null,
    compiled: null,
    selection: null,
    base: project.name && project.version ? { name: project.name, version: project.version } : null,
    editor: "leader",
    isOpening: false,
    generation: generation + 1,
  }));
}

/** Let the cars be of another kind: those of a profile, or, where there is a `car`, as one that was measured. */
export function chooseKind(profile: string, car: MeasuredCar | null): void {
  if (isFixed()) return;
  const before = useStudio.getState();
  const show = (kind: Pick<Studio, "profile" | "car">) => () => {
    // The editors are created anew: their blocks say what a level means.
    collectEdits();
    useStudio.setState(kind);
  };
  const undo = show({ profile: before.profile, car: before.car });
  const redo = show({ profile, car });
  redo();
  record({ key: "kind", undo, redo });
  endEdit();
}

/**
 * Open another project in place of the user's own, once unsaved changes are saved or the user agrees to lose them; false
 * if they do not. `stored`: a file or the library holds it.
 */
export async function replaceBy(project: OpenedProject, { stored = false } = {}): Promise<boolean> {
  collectEdits();
  const { kept, unsaved } = useStudio.getState();
  if (kept?.unsaved ?? unsaved) {
    const chosen = await ask({
      title: say("project.replaceTitle"),
      text: say("project.replaceText"),
      yes: say("project.saveAndOpen"),
      other: say("project.replaceYes"),
    });
    if (chosen === "no") return false;
    if (chosen === "yes" && !(await saveOwn())) return false;
  }
  useStudio.setState({ kept: null });
  fillBy(project, { stored });
  return true;
}

/** Fill the page with a project, which a file or the library holds, or that is as new. */
function fillBy(project: OpenedProject, { stored = false } = {}): void {
  loadProject(project);
  session.stand();
  // The editors are filled in the same turn; what they hold then is the saved project.
  setTimeout(() => {
    markSaved();
    useStudio.setState({ stored });
  });
}

/** Open a mission's project; the user's own is kept as it stands, until `comeBack`. */
export function putAside(project: OpenedProject): void {
  collectEdits();
  if (!useStudio.getState().kept) library.putAside();
  useStudio.setState((studio) => ({ kept: studio.kept ?? ownProject(studio) }));
  fillBy(project);
}

/** Come back to the user's own project as it stood; where none was put aside, the open one becomes it. */
export function comeBack(): void {
  collectEdits();
  const { kept } = useStudio.getState();
  if (!kept) {
    useStudio.setState({ mission: null });
    return;
  }
  const { rangeMm, unsaved, stored, base, parkedFollowers, ...project } = kept;
  loadProject({ ...project, range_mm: rangeMm }, parkedFollowers);
  session.stand();
  useStudio.setState({ kept: null, stored, base });
  setTimeout(() => {
    if (!unsaved) markSaved();
    else library.takeBack();
  });
}

/** Save the user's own project to the library, under a free name where it has none; false where it isn't saved. */
async function saveOwn(): Promise<boolean> {
  if (useStudio.getState().kept) {
    comeBack();
    await new Promise((resolve) => setTimeout(resolve));
  }
  if (!useStudio.getState().name.trim()) {
    const taken = new Set((await request("projects/list")).map(({ name }) => name));
    const plain = say("project.unnamed");
    let name = plain;
    for (let number = 2; taken.has(name); number++) name = `${plain} ${number}`;
    useStudio.setState({ name });
  }
  return library.save();
}

/** What a file or the library holds of the open project. It is written when the user saves. */
class Library {
  /** The project as it is held; "nowhere" for one that came by a link or from autosave; null before the first project. */
  private held: SavedParts | "nowhere" | null = null;
  /** The same of the project that a mission has put aside; null after the page was loaded anew. */
  private aside: SavedParts | "nowhere" | null = null;

  /**
   * Save the next version, under the project's name; false where the user doesn't agree to it. Throws RefusedError or
   * UnreachableError; the project is unsaved then.
   */
  async save(): Promise<boolean> {
    const name = useStudio.getState().name.trim();
    const project = openProject();
    const sent = useStudio.getState();
    const saved = await saveVersion(name, project);
    if (!saved) return false;
    const { version, stays } = saved;
    // What has changed meanwhile is not in it.
    this.hold(sent);
    useStudio.setState({ stored: true, base: { name, version } });
    if (stays) notify(say("library.saved", { name, version }), "success");
    else {
      notify(say("library.savedForNow", { name, version }), "warning");
      window.addEventListener("beforeunload", askToStay);
    }
    return true;
  }

  hold(held: SavedParts | "nowhere"): void {
    this.held = held;
    this.compare();
  }

  private compare(): void {
    const now = useStudio.getState();
    const unsaved = this.held === "nowhere" || (this.held !== null && !equalProjects(now, this.held));
    if (unsaved !== now.unsaved) useStudio.setState({ unsaved });
  }

  putAside(): void {
    this.aside = this.held;
  }

  takeBack(): void {
    useStudio.setState({ unsaved: true });
    this.held = this.aside ?? "nowhere";
  }

  watch(): void {
    useStudio.subscribe((now, before) => {
      if (this.held !== null && !sameProject(now, before)) this.compare();
    });
  }
}

/** That of this page. */
export const library = new Library();

/** Let the browser ask whether to leave the page, since saved projects go with it. */
const askToStay = (event: BeforeUnloadEvent) => event.preventDefault();

/** Save the next version; ask first where it isn't made from the newest one. Null where the user doesn't agree. */
async function saveVersion(name: string, project: Project): Promise<SavedVersion | null> {
  const { base } = useStudio.getState();
  try {
    return await request("projects/write", { name, project, base: base?.name === name ? base.version : 0 });
  } catch (error) {
    if (!(error instanceof RefusedError) || !["saved-elsewhere", "project-exists"].includes(error.code)) throw error;
    const agreed = await confirm({
      title: say("library.elsewhereTitle", { name }),
      text: `${inLanguage(error.sentence)} ${say("library.elsewhereText")}`,
      yes: say("library.saveNext"),
    });
    return agreed ? request("projects/write", { name, project, base: null }) : null;
  }
}

/** The open project is held as it is now, or as it was when it was `sent`. */
export function markSaved(sent?: Studio): void {
  collectEdits();
  library.hold(sent ?? useStudio.getState());
}

/** The open project is in no file: it was restored, or came by a link. */
export const markUnsaved = () => library.hold("nowhere");
