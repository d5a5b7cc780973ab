/** Store this page's windows of a pair as they change, and show the other's. */

import { RefusedError, request } from "../api/service";
import { type EditorName, EDITORS, type MissionChoice, type Project } from "../api/types";
import { askClass } from "../classroom/ask";
import { EMPTY_FOLLOWERS, fill, lockEditors, read, workspaceOf } from "../blocks/workspaces";
import type { Conducted, PairProject, PairView } from "../generated/classroom";
import { say } from "../i18n";
import { playMission } from "../missions/store";
import { session } from "../mat/session";
import { useMat } from "../mat/store";
import { attempt } from "../projects/actions";
import { Keeper, type Place } from "../projects/keeper";
import { markUnsaved, openProject, replaceBy } from "../projects/project";
import { notify } from "../state/dialogs";
import { EMPTY_MAT, type Studio, useStudio } from "../state/studio";
import { endAll } from "../ui/areas";
import { isForeign, type Playing, usePair } from "./store";

const WRITE_MS = 250;
const AGAIN_MS = 2000;
/** What of the page belongs to a window: the mat belongs to the leader's. */
const PARTS = { leader: ["leader", "mat", "rangeMm", "car", "profile"], followers: ["followers"] } as const satisfies Record<EditorName, (keyof Studio)[]>;

/** Whether another project or mission was opened; a bit that is flipped loads other blocks of the same mission. */
const isOpened = (now: Studio, before: Studio) => now.mission !== before.mission || (!now.mission && now.generation !== before.generation);

const mine = (window: EditorName) => usePair.getState().view?.owners[window] === usePair.getState().me;

/** A window of the pair's project on the class's server, which this page stores where it is its user's, and else shows. */
export class PairWindow implements Place {
  readonly keeper = new Keeper(this, WRITE_MS, AGAIN_MS);
  /** The blocks that this page shows of it, as its editor writes them; null until the editor has them. */
  shown: string | null = null;

  constructor(
    readonly name: EditorName,
    /** What it holds, as far as this page knows. */
    public held: PairProject,
    private readonly pair: Pick<Pair, "id" | "isFilling" | "isOver">,
  ) {}

  /** Whether the page has changed what belongs to the window. */
  differs(now: Studio, before: Studio): boolean {
    return PARTS[this.name].some((part) => now[part] !== before[part]);
  }

  concerns(now: Studio, before: Studio): boolean {
    // What is opened in place of the pair's project is none of the pair's.
    return !this.pair.isFilling && !isOpened(now, before) && mine(this.name) && this.differs(now, before);
  }

  async write(): Promise<void> {
    // What is opened in its place belongs to nobody's window yet.
    if (this.pair.isFilling) return;
    const project = projectOf(this.name);
    if (JSON.stringify(project) === JSON.stringify(this.held.project)) return;
    try {
      const version = await askClass("pair/write", { pair: this.pair.id, window: this.name, project, base: this.held.version });
      this.held = { project, version };
    } catch (problem) {
      if (!(problem instanceof RefusedError)) throw problem;
      await this.keepOwn();
    }
  }

  /** The window is another's now, or another page of the same user has stored it: what this page made goes to the library. */
  private async keepOwn(): Promise<void> {
    const name = say("pair.ownName", { name: usePair.getState().view?.name ?? "" });
    await attempt(async () => {
      await request("projects/write", { name, project: projectOf(), base: null });
      notify(say("pair.ownKept", { name }), "warning");
      await this.refresh();
    });
  }

  /** Show what the window holds now. While nothing answers, what is shown stays: the next version asks again. */
  async refresh(): Promise<void> {
    const found = await askClass("pair/read", { window: this.name }).catch(() => null);
    if (!found || this.pair.isOver || found.version < this.held.version) return;
    this.held = found;
    this.show();
  }

  show(): void {
    const { project } = this.held;
    const { leader, followers, mat, range_mm: rangeMm, car, profile } = project;
    const isLeaders = this.name === "leader";
    const parts: Partial<Studio> = isLeaders ? { leader, mat: mat ?? EMPTY_MAT, rangeMm, car, profile } : { followers };
    const differs = (Object.keys(parts) as (keyof Studio)[]).filter((part) => JSON.stringify(useStudio.getState()[part]) !== JSON.stringify(parts[part]));
    this.pair.isFilling = true;
    useStudio.setState(Object.fromEntries(differs.map((part) => [part, parts[part]])));
    const workspace = workspaceOf(this.name);
    const blocks = project[this.name];
    this.shown = null;
    if (workspace && differs.includes(this.name) && blocks) {
      const { scrollX, scrollY } = workspace;
      fill(this.name, blocks);
      workspace.scroll(scrollX, scrollY);
      useStudio.setState({ [this.name]: read(this.name) });
      this.shown = JSON.stringify(useStudio.getState()[this.name]);
    }
    this.pair.isFilling = false;
  }

  /** A change of a window that this page only shows is undone. */
  undo(now: Studio, before: Studio): void {
    if (this.shown === null && now[this.name] !== null && now[this.name] !== before[this.name]) {
      // The editor has just taken the blocks, and writes them in its own way.
      this.shown = JSON.stringify(now[this.name]);
    } else if (this.shown !== JSON.stringify(now[this.name]) || (this.name === "leader" && now.mat !== before.mat)) {
      const owner = usePair.getState().view?.partner?.name;
      notify(owner ? say("pair.readOnly", { name: owner }) : say("pair.readOnlyFree"), "warning");
      setTimeout(() => this.pair.isOver || mine(this.name) || this.show());
    }
  }
}

/** Both windows, from the beginning of the pair to its end. */
class Pair {
  /** The page is shown what a window holds, which is no edit. */
  isFilling = false;
  isOver = false;
  readonly windows: readonly PairWindow[];
  private readonly stop: () => void;

  constructor(
    readonly id: string,
    leader: PairProject,
    followers: PairProject,
  ) {
    this.windows = [new PairWindow("leader", leader, this), new PairWindow("followers", followers, this)];
    this.stop = endAll(
      useStudio.subscribe((now, before) => this.notice(now, before)),
      ...this.windows.map(({ keeper }) => keeper.start()),
      () => (session.onCommand = null),
    );
    session.onCommand = ({ playing, speed, seed, shown_ms, t_ms }) => {
      // A project that was opened stands at its beginning, on each page.
      if (!this.isFilling) void tell({ playing, speed, seed, t_ms: shown_ms ?? t_ms });
    };
  }

  private notice(now: Studio, before: Studio): void {
    if (this.isFilling) return;
    if (isOpened(now, before)) {
      this.isFilling = true;
      const { mission } = before;
      // At the end of the turn the page knows which mission follows.
      setTimeout(() => void (mission && useStudio.getState().mission ? goOn(this.id) : leave()));
      return;
    }
    for (const window of this.windows) if (!mine(window.name) && window.differs(now, before)) window.undo(now, before);
  }

  /** Store what has changed in own windows, also while they were stored; what can't be stored there is kept in the library. */
  async write(): Promise<void> {
    for (let round = 0; round < 2; round++) await Promise.all(this.windows.map(({ keeper }) => keeper.keepNow()));
  }

  /** Show what the other has stored since `before`, and play as the other plays. */
  async follow(view: PairView, before: PairView): Promise<void> {
    lock();
    if (EDITORS.some((window) => view.owners[window] !== before.owners[window])) showOwn();
    for (const window of this.windows) {
      const isNewer = (view.versions[window.name] ?? 0) > window.held.version;
      // What this page stores is told to it too, maybe before the answer.
      if (isNewer && !(mine(window.name) && !window.keeper.isKept)) await window.refresh();
    }
    const { conducted } = view;
    if (conducted && conducted.by !== usePair.getState().me && conducted.number !== before.conducted?.number) session.follow(nowOf(conducted));
    if (view.partner_joined && !before.partner_joined && mine("leader")) {
      const { state, seed, speed } = useMat.getState();
      void tell({ playing: state?.playing ?? false, speed, seed, t_ms: state?.t_ms ?? 0 });
    }
  }

  end(): void {
    this.isOver = true;
    this.stop();
    lockEditors(new Set());
  }
}

/** Take what is known of the pair now; null: there is none any more. */
export function receive(view: PairView | null, me: string): void {
  const { view: before, pair } = usePair.getState();
  usePair.setState({ view, me });
  if (view?.joined && before?.joined && view.id === before.id) void pair?.follow(view, before);
  else {
    usePair.setState({ pair: null });
    pair?.end();
    if (view?.joined) void begin(view, before?.joined ? before.partner?.name : undefined);
  }
}

const asText = ({ leader, followers, mat, range_mm, car, profile }: Project) =>
  JSON.stringify([leader, followers, mat ?? EMPTY_MAT, range_mm ?? null, car ?? null, profile]);

const missionText = (mission: MissionChoice | null) => JSON.stringify([mission?.id ?? "", mission?.document ?? null]);
const sameMission = (one: MissionChoice | null, other: MissionChoice | null) => missionText(one) === missionText(other);

/** How the other page plays now: it has played on since it said so. */
const nowOf = (conducted: Conducted): Playing => {
  const passed = conducted.playing ? conducted.age_ms * conducted.speed : 0;
  return { ...conducted, t_ms: Math.round(conducted.t_ms + passed) };
};

/** What the page holds as a project; of a window, only what belongs to it. */
function projectOf(window?: EditorName): Project {
  const project = { ...openProject(), python: null, level: null };
  if (window === "followers") return { ...project, leader: {}, mat: null, range_mm: null, car: null };
  return window ? { ...project, followers: null } : project;
}

let begun = 0;

/** Show what a pair has open; `opener` has opened it for both, unless this page has it open already. */
async function begin(view: PairView, opener?: string): Promise<void> {
  const number = ++begun;
  await attempt(async () => {
    const [leader, followers] = await Promise.all(EDITORS.map((window) => askClass("pair/read", { window })));
    // The whole project, of both windows.
    const whole: Project = { ...leader!.project, followers: followers!.project.followers, python: null, level: null };
    const mission = leader!.mission ?? null;
    // The pair may be over meanwhile, or have gone on.
    if (number !== begun || !usePair.getState().view?.joined) return;
    if (!sameMission(mission, useStudio.getState().mission) || asText(whole) !== asText(projectOf())) {
      const opened = mission ? await playMission(mission, whole) : await replaceBy({ ...whole, name: view.name });
      if (number !== begun) return;
      if (!opened) {
        await askClass("pair/leave");
        return;
      }
      // The editors take the project in this turn.
      await new Promise((resolve) => setTimeout(resolve));
      markUnsaved();
      if (opener) notify(say("pair.wentOn", { name: opener, mission: view.name }));
    }
    if (number !== begun || !usePair.getState().view?.joined) return;
    const pair = new Pair(view.id, leader!, followers!);
    usePair.setState({ pair });
    lock();
    showOwn();
    const { view: now } = usePair.getState();
    if (now?.conducted) session.follow(nowOf(now.conducted));
    if (now) await pair.follow(now, now);
  });
}

/** The user has opened another mission: both go on with it. Where that can't be, the page shows what the pair has open. */
async function goOn(id: string): Promise<void> {
  const { name, mission } = useStudio.getState();
  const done = await attempt(() => askClass("pair/open", { pair: id, name, project: projectOf(), mission: mission! }));
  const { view, pair } = usePair.getState();
  if (done || view?.id !== id) return;
  usePair.setState({ pair: null });
  pair?.end();
  await begin(view);
}

/** Show the own window where there is room for one; the followers' begins with its first block, but in a mission without followers. */
function showOwn(): void {
  const own = EDITORS.filter(mine);
  if (own.length !== 1) return;
  const [editor] = own as [EditorName];
  const { followers, mission } = useStudio.getState();
  if (editor === "leader" || followers) useStudio.setState({ editor });
  else if (!mission) useStudio.setState({ editor, followers: EMPTY_FOLLOWERS });
}

const tell = (playing: Playing) => askClass("pair/conduct", playing).catch(() => undefined);
const lock = () => lockEditors(new Set(EDITORS.filter((window) => isForeign(usePair.getState(), window))));

/** Leave the pair; the project stays open. */
export function leave(): Promise<unknown> {
  return attempt(async () => {
    await usePair.getState().pair?.write();
    const copied = await askClass("pair/leave");
    receive(null, "");
    notify(copied ? say("pair.leftCopy", { name: copied }) : say("pair.ended"));
  });
}
