/**
 * A pair between two tabs of one browser. A window is whose tab holds its lock, so two tabs never have the same one, and
 * the browser gives it back when a tab is closed or crashes. What the windows hold lies in the browser's storage.
 */

import i18next from "i18next";
import { RefusedError, UnreachableError } from "../api/service";
import { type EditorName, EDITORS } from "../api/types";
import { uniqueName } from "../api/world";
import type { Conducted, PairProject, PairView } from "../generated/classroom";
import { openProject } from "../projects/project";
import { notify } from "../state/dialogs";
import { openChannel } from "../state/otherTabs";
import { keep } from "../state/storage";
import { useStudio } from "../state/studio";
import { receive, write } from "./follow";
import { addressOf, rememberPair, type SharedWindows } from "./store";

const KEY = "motorcade.pair.";
/** The windows of this tab, for after a reload. */
const WINDOWS_KEY = "motorcade.windows";
/** A reloaded page releases its locks only a moment after the new page has started. */
const PATIENCE_MS = 1000;
const ASK_MS = 3000;
const AWAY_MS = 10_000;

/** `here`: what the sender has, and whether it wants to know of others; `gone`: it leaves; `swap`: both agree. */
type Told =
  | { is: "here"; owns: EditorName[]; asks: boolean; wantsAnswer: boolean }
  | { is: "gone" | "swap" }
  | { is: "stored"; window: EditorName; version: number }
  | { is: "conduct"; conducted: Conducted };

/** By plain HTTP from another computer there are no locks. */
export const canShare = () => "locks" in navigator;

/** Hold a lock until what it resolves to is called; null where another tab has it. `onEnd`: it was given back, or taken. */
function holdLock(name: string, options: LockOptions, onEnd: () => void = () => undefined): Promise<(() => void) | null> {
  return new Promise((resolve) => {
    const held = navigator.locks.request(name, options, (lock) => {
      if (lock) return new Promise<void>((release) => resolve(release));
      resolve(null);
      return undefined;
    });
    held.then(onEnd, () => {
      resolve(null);
      onEnd();
    });
  });
}

/** To wait so long for a lock; 0: not at all. */
const patience = (ms: number): LockOptions => (ms ? { signal: AbortSignal.timeout(ms) } : { ifAvailable: true });

/** What lies under a key; null where that is nothing, or damaged. */
function storedAt(key: string): unknown {
  try {
    return JSON.parse(localStorage.getItem(KEY + key) ?? "null");
  } catch {
    return null;
  }
}

class Tabs implements SharedWindows {
  private readonly me = uniqueName();
  private readonly channel: BroadcastChannel | null;
  /** What gives each own window back. */
  private readonly owned = new Map<EditorName, () => void>();
  private readonly others = new Map<string, { owns: EditorName[]; asks: boolean; heardAt: number }>();
  private readonly versions: Record<EditorName, number> = { leader: 0, followers: 0 };
  private readonly timer: ReturnType<typeof setInterval>;
  private asks = false;
  private conducted: Conducted | null = null;
  private readonly closed = new AbortController();

  constructor(
    private readonly id: string,
    private readonly name: string,
  ) {
    this.channel = openChannel(KEY + id, (told: Told & { from: string }) => void this.hear(told));
    window.addEventListener("pagehide", () => this.say({ is: "gone" }), { signal: this.closed.signal });
    this.timer = setInterval(() => document.hidden || this.tellOthers(true), ASK_MS);
    void this.lock(`tab.${this.me}`, {});
    for (const each of EDITORS) this.versions[each] = this.stored(each)?.version ?? 0;
  }

  /** Take these windows as far as they are free; then the page follows the pair. */
  async begin(windows: readonly EditorName[], patienceMs = 0): Promise<void> {
    for (const each of windows) await this.hold(each, patience(patienceMs));
    rememberPair(this.id);
    this.publish();
    this.tellOthers(true);
  }

  get owns(): EditorName[] {
    return [...this.owned.keys()];
  }

  private lock(name: string, options: LockOptions, onEnd?: () => void): Promise<(() => void) | null> {
    return holdLock(`${KEY}${this.id}.${name}`, options, onEnd);
  }

  private async hold(each: EditorName, options: LockOptions): Promise<boolean> {
    if (this.owned.has(each)) return true;
    let release: (() => void) | null = null;
    const lost = () => {
      if (this.owned.get(each) === release) this.owned.delete(each);
      this.tellOthers();
      this.publish();
    };
    release = await this.lock(each, options, () => release && lost());
    if (release) this.owned.set(each, release);
    return release !== null;
  }

  private stored(each: EditorName): PairProject | null {
    return storedAt(`${this.id}.${each}`) as PairProject | null;
  }

  private view(): PairView {
    const others = [...this.others].sort(([, a], [, b]) => b.owns.length - a.owns.length);
    const [partner, other] = others[0] ?? [null, null];
    const owner = (each: EditorName) => (this.owned.has(each) ? this.me : (others.find(([, { owns }]) => owns.includes(each))?.[0] ?? null));
    return {
      name: this.name,
      partner: partner === null ? null : { id: partner, name: i18next.t("pair.otherTab"), avatar: "" },
      joined: true,
      partner_joined: partner !== null,
      partner_away: other !== null && Date.now() - other.heardAt > AWAY_MS,
      owners: { leader: owner("leader"), followers: owner("followers") },
      versions: { ...this.versions },
      asks: this.asks ? this.me : other?.asks ? partner : null,
      conducted: this.conducted,
    };
  }

  private publish(): void {
    if (this.closed.signal.aborted) return;
    keep("sessionStorage", WINDOWS_KEY, this.owns.join());
    receive(this.view(), this.me, this);
  }

  private say(told: Told): void {
    if (!this.closed.signal.aborted) this.channel?.postMessage({ from: this.me, ...told });
  }

  private tellOthers(wantsAnswer = false): void {
    this.say({ is: "here", owns: this.owns, asks: this.asks, wantsAnswer });
    if (wantsAnswer) this.publish();
  }

  private async hear(told: Told & { from: string }): Promise<void> {
    switch (told.is) {
      case "here": {
        // Its lock is free as soon as it is closed, or has crashed.
        if (!this.others.has(told.from)) void this.lock(`tab.${told.from}`, {}).then((release) => {
          release?.();
          this.forget(told.from);
        });
        this.others.set(told.from, { owns: told.owns, asks: told.asks, heardAt: Date.now() });
        if (told.wantsAnswer) this.tellOthers();
        break;
      }
      case "gone":
        this.forget(told.from);
        break;
      case "stored":
        this.versions[told.window] = told.version;
        break;
      case "conduct":
        this.conducted = told.conducted;
        break;
      case "swap":
        await this.exchange();
    }
    this.publish();
  }

  private forget(other: string): void {
    this.others.delete(other);
    this.publish();
  }

  private async exchange(): Promise<void> {
    await write();
    const wanted = EDITORS.filter((each) => !this.owned.has(each));
    this.asks = false;
    for (const release of [...this.owned.values()]) release();
    this.owned.clear();
    // The other tab gives its window back in the same moment.
    for (const each of wanted) await this.hold(each, patience(ASK_MS));
    this.tellOthers(true);
  }

  read(each: EditorName): Promise<PairProject> {
    const found = this.stored(each);
    return found ? Promise.resolve(found) : Promise.reject(new UnreachableError());
  }

  write(each: EditorName, project: PairProject["project"], base: number): Promise<number> {
    const refused = (code: string) => Promise.reject(new RefusedError(code, { en: code, zh: code }));
    if (!this.owned.has(each)) return refused("window-of-another");
    if ((this.stored(each)?.version ?? 0) !== base) return refused("saved-elsewhere");
    if (!keep("localStorage", `${KEY}${this.id}.${each}`, JSON.stringify({ project, version: base + 1 } satisfies PairProject))) {
      notify(i18next.t("pair.noStorage"), "warning");
      return Promise.reject(new UnreachableError());
    }
    this.versions[each] = base + 1;
    this.say({ is: "stored", window: each, version: base + 1 });
    return Promise.resolve(base + 1);
  }

  async take(each: EditorName, wants: boolean): Promise<void> {
    if (!wants) {
      await write();
      this.owned.get(each)?.();
    } else if (!(await this.hold(each, this.view().partner_away ? { steal: true } : { ifAvailable: true }))) {
      notify(i18next.t("pair.onlooker"), "warning");
    }
    this.tellOthers(true);
  }

  async swap(wants: boolean): Promise<void> {
    if (wants && [...this.others.values()].some(({ asks }) => asks)) {
      this.say({ is: "swap" });
      await this.exchange();
      return;
    }
    this.asks = wants;
    this.tellOthers(true);
  }

  join(): Promise<void> {
    return Promise.resolve();
  }

  leave(): Promise<string> {
    for (const release of this.owned.values()) release();
    this.say({ is: "gone" });
    this.closed.abort();
    clearInterval(this.timer);
    this.channel?.close();
    rememberPair(null);
    if (this.others.size === 0) for (const each of ["", ...EDITORS]) localStorage.removeItem(`${KEY}${this.id}${each && `.${each}`}`);
    return Promise.resolve("");
  }

  conduct(playing: Omit<Conducted, "number" | "by">): Promise<void> {
    this.conducted = { ...playing, number: (this.conducted?.number ?? 0) + 1, by: this.me };
    this.say({ is: "conduct", conducted: this.conducted });
    return Promise.resolve();
  }
}

/** Share the open project between this tab, which gets the leader's window, and one that is opened; false where nothing is stored. */
export async function openSecondWindow(): Promise<boolean> {
  const id = uniqueName();
  const project = openProject();
  const name = useStudio.getState().name.trim() || i18next.t("pair.nameless");
  const window = JSON.stringify({ project, version: 1 } satisfies PairProject);
  const stored = [[`${id}.leader`, window], [`${id}.followers`, window], [id, JSON.stringify(name)]] as const;
  if (!stored.every(([key, text]) => keep("localStorage", KEY + key, text))) return false;
  await new Tabs(id, name).begin(["leader"]);
  // A tab with an opener would begin with this one's session storage.
  open(addressOf(id), "_blank", "noopener");
  return true;
}

/** Come into the pair of another tab, or back into it after a reload: take the windows of before, the followers', or else the one that is free. */
export async function comeIn(id: string, isNew: boolean): Promise<void> {
  const name = storedAt(id) as string | null;
  if (name === null || !canShare()) {
    rememberPair(null);
    if (name === null) notify(i18next.t("share.damaged"), "error");
    return;
  }
  const tabs = new Tabs(id, name);
  const had = isNew ? null : sessionStorage.getItem(WINDOWS_KEY);
  await tabs.begin(had === null ? ["followers"] : EDITORS.filter((each) => had.includes(each)), PATIENCE_MS);
  if (tabs.owns.length === 0) await tabs.begin(["leader"]);
}
