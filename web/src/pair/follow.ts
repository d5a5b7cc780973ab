/** Store this page's windows of a pair as they change, and show the other's. */

import { RefusedError, request, UnreachableError } from "../api/service";
import { type EditorName, EDITORS, type Project } from "../api/types";
import { askClass } from "../classroom/ask";
import { emptyState, fill, lockEditors, read, workspaceOf } from "../blocks/workspaces";
import type { PairProject, PairView } from "../generated/classroom";
import { say } from "../i18n";
import { session } from "../mat/session";
import { useMat } from "../mat/store";
import { attempt } from "../projects/actions";
import { markUnsaved, openProject, replaceBy } from "../projects/project";
import { notify } from "../state/dialogs";
import { EMPTY_MAT, type Studio, useStudio } from "../state/studio";
import { isForeign, type Playing, usePair } from "./store";

const WRITE_MS = 250;
const AGAIN_MS = 2000;
/** What of the page belongs to a window: the mat belongs to the leader's. */
const PARTS = { leader: ["leader", "mat", "rangeMm", "profile"], followers: ["followers"] } as const satisfies Record<EditorName, (keyof Studio)[]>;

/** What each window holds, as far as this page knows. */
let held: Record<EditorName, PairProject> | null = null;
/** The blocks that this page shows of each window, as its editor writes them; null until the editor has them. */
const shown: Record<EditorName, string | null> = { leader: null, followers: null };
const changed = new Set<EditorName>();
let timer: ReturnType<typeof setTimeout> | undefined;
let writing: Promise<void> | null = null;
let filling = false;
let stop: (() => void) | null = null;

const mine = (window: EditorName) => usePair.getState().view?.owners[window] === usePair.getState().me;

/** Take what is known of the pair now; null: there is none any more. */
export function receive(view: PairView | null, me: string): void {
  const { view: before } = usePair.getState();
  usePair.setState({ view, me });
  if (view?.joined && !before?.joined) void begin(view);
  else if (!view?.joined && before?.joined) end();
  else if (view?.joined && held) void follow(view, before!);
}

/** The whole project, of both windows. */
function whole(): Project {
  return { ...held!.leader.project, followers: held!.followers.project.followers, python: null, level: null };
}

const asText = ({ leader, followers, mat, range_mm, profile }: Project) => JSON.stringify([leader, followers, mat ?? EMPTY_MAT, range_mm ?? null, profile]);

/** What the page holds as a project; of a window, only what belongs to it. */
function projectOf(window?: EditorName): Project {
  const project = { ...openProject(), python: null, level: null };
  if (window === "followers") return { ...project, leader: {}, mat: null, range_mm: null };
  return window ? { ...project, followers: null } : project;
}

async function begin(view: PairView): Promise<void> {
  await attempt(async () => {
    const [leader, followers] = await Promise.all(EDITORS.map((window) => askClass("pair/read", { window })));
    held = { leader: leader!, followers: followers! };
    if (asText(whole()) !== asText(projectOf())) {
      if (!(await replaceBy({ ...whole(), name: view.name }))) {
        await askClass("pair/leave");
        return;
      }
      // The editors take the project in this turn.
      await new Promise((resolve) => setTimeout(resolve));
      markUnsaved();
    }
    shown.leader = shown.followers = null;
    stop = useStudio.subscribe(notice);
    document.addEventListener("visibilitychange", writeHidden);
    lock();
    session.onCommand = ({ playing, speed, seed, shown_ms, t_ms }) => void tell({ playing, speed, seed, t_ms: shown_ms ?? t_ms });
    showOwn();
    const { view: now } = usePair.getState();
    if (now?.conducted) session.follow(now.conducted);
    if (now) await follow(now, now);
  });
}

/** Show the own window where there is room for one; the followers' begins with its first block. */
function showOwn(): void {
  const own = EDITORS.filter(mine);
  if (own.length !== 1) return;
  const { followers } = useStudio.getState();
  useStudio.setState({ editor: own[0]!, ...(own[0] === "followers" && !followers && { followers: emptyState("followers") }) });
}

const tell = (playing: Playing) => askClass("pair/conduct", playing).catch(() => undefined);
const writeHidden = () => document.hidden && void write();

function end(): void {
  stop?.();
  stop = null;
  held = null;
  changed.clear();
  clearTimeout(timer);
  document.removeEventListener("visibilitychange", writeHidden);
  session.onCommand = null;
  lockEditors(new Set());
}

const lock = () => lockEditors(new Set(EDITORS.filter((window) => isForeign(usePair.getState(), window))));

/** Show what the other has stored since `before`, and play as the other plays. */
async function follow(view: PairView, before: PairView): Promise<void> {
  lock();
  for (const window of EDITORS) {
    // What this page stores is told to it too, maybe before the answer.
    if (!held || (view.versions[window] ?? 0) <= held[window].version || (mine(window) && (changed.has(window) || writing))) continue;
    await refresh(window);
  }
  const { conducted } = view;
  if (conducted && conducted.by !== usePair.getState().me && conducted.number !== before.conducted?.number) session.follow(conducted);
  if (view.partner_joined && !before.partner_joined && mine("leader")) {
    const { state, seed, speed } = useMat.getState();
    void tell({ playing: state?.playing ?? false, speed, seed, t_ms: state?.t_ms ?? 0 });
  }
}

/** Show what a window holds now. While nothing answers, what is shown stays: the next version asks again. */
async function refresh(window: EditorName): Promise<void> {
  const found = await askClass("pair/read", { window }).catch(() => null);
  if (!found || !held || found.version < held[window].version) return;
  held[window] = found;
  show(window);
}

function show(window: EditorName): void {
  const { project } = held![window];
  const parts = window === "leader" ? { leader: project.leader, mat: project.mat ?? EMPTY_MAT, rangeMm: project.range_mm, profile: project.profile } : { followers: project.followers };
  const differs = (Object.keys(parts) as (keyof Studio)[]).filter((part) => JSON.stringify(useStudio.getState()[part]) !== JSON.stringify((parts as Partial<Studio>)[part]));
  filling = true;
  useStudio.setState(Object.fromEntries(differs.map((part) => [part, (parts as Partial<Studio>)[part]])));
  const workspace = workspaceOf(window);
  shown[window] = null;
  if (workspace && differs.includes(window) && project[window]) {
    const { scrollX, scrollY } = workspace;
    fill(window, project[window]);
    workspace.scroll(scrollX, scrollY);
    useStudio.setState({ [window]: read(window) });
    shown[window] = JSON.stringify(useStudio.getState()[window]);
  }
  filling = false;
}

/** A change of the page: store one of an own window, undo one of a window that this page only shows. */
function notice(now: Studio, before: Studio): void {
  if (filling) return;
  if (now.generation !== before.generation) {
    void leave();
    return;
  }
  for (const window of EDITORS) {
    if (PARTS[window].every((part) => now[part] === before[part])) continue;
    if (mine(window)) {
      changed.add(window);
      timer ??= setTimeout(() => void write(), WRITE_MS);
    } else if (shown[window] === null && now[window] !== null && now[window] !== before[window]) {
      // The editor has just taken the blocks, and writes them in its own way.
      shown[window] = JSON.stringify(now[window]);
    } else if (shown[window] !== JSON.stringify(now[window]) || (window === "leader" && now.mat !== before.mat)) {
      const owner = usePair.getState().view?.partner?.name;
      notify(owner ? say("pair.readOnly", { name: owner }) : say("pair.readOnlyFree"), "warning");
      setTimeout(() => held && !mine(window) && show(window));
    }
  }
}

/** Store what has changed in own windows; what can't be stored as the window is kept in the library. */
export function write(): Promise<void> {
  clearTimeout(timer);
  timer = undefined;
  writing ??= writeAll().finally(() => {
    writing = null;
    if (changed.size) timer ??= setTimeout(() => void write(), AGAIN_MS);
  });
  return writing;
}

async function writeAll(): Promise<void> {
  for (const window of [...changed]) {
    const project = projectOf(window);
    changed.delete(window);
    if (!held || JSON.stringify(project) === JSON.stringify(held[window].project)) continue;
    try {
      const version = await askClass("pair/write", { window, project, base: held[window].version });
      // Unless the pair is over meanwhile.
      if (stop) held[window] = { project, version };
    } catch (problem) {
      if (problem instanceof UnreachableError) changed.add(window);
      else if (problem instanceof RefusedError) await keepOwn(window);
      else throw problem;
    }
  }
}

/** The window is another's now, or another page of the same user has stored it: what this page made goes to the library. */
async function keepOwn(window: EditorName): Promise<void> {
  const name = say("pair.ownName", { name: usePair.getState().view?.name ?? "" });
  await attempt(async () => {
    await request("projects/write", { name, project: projectOf(), base: null });
    notify(say("pair.ownKept", { name }), "warning");
    if (held) await refresh(window);
  });
}

/** Leave the pair; the project stays open. */
export function leave(): Promise<unknown> {
  return attempt(async () => {
    if (stop) await write();
    const copied = await askClass("pair/leave");
    receive(null, "");
    notify(copied ? say("pair.leftCopy", { name: copied }) : say("pair.ended"));
  });
}
