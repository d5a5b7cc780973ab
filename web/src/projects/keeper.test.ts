import { afterAll, afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import texts from "virtual:texts/studio";
import { connectTo, RefusedError, UnreachableError } from "../api/service";
import type { EditorName } from "../api/types";
import { startTexts } from "../i18n";
import { PairWindow } from "../pair/follow";
import { usePair } from "../pair/store";
import { draft } from "../pupil/store";
import { useQuestion } from "../state/questions";
import { own } from "../state/otherTabs";
import { useStudio } from "../state/studio";
import { autosave } from "./autosave";
import { Keeper } from "./keeper";
import { library, markSaved } from "./project";

/** How a place answers: `full` and `taken` refuse the work, `late` answers when the test says so. */
type Mode = "ok" | "gone" | "full" | "taken" | "late";

let mode: Mode = "ok";
let answerLate: () => void = () => undefined;
/** The texts of all work that is in some place. */
let held: string[] = [];

function reply(text: string): Promise<{ version: number; stays: boolean }> {
  const answer = { version: held.length + 1, stays: true };
  const store = () => {
    held.push(text);
    return answer;
  };
  if (mode === "gone") return Promise.reject(new UnreachableError());
  if (mode === "full" || mode === "taken") return Promise.reject(new RefusedError(mode === "full" ? "disk-full" : "saved-elsewhere", { en: "No.", zh: "" }));
  if (mode === "ok") return Promise.resolve(store());
  return new Promise((resolve) => (answerLate = () => resolve(store())));
}

/** A server of a class, which answers as a place of the library does. */
async function classServer(path: string, { body }: { body: string }): Promise<Response> {
  if (path.endsWith("pair/read")) return Response.json({ project: {}, version: 99 });
  try {
    const { version } = await reply(body);
    return Response.json(path.endsWith("pair/write") ? version : {});
  } catch (problem) {
    if (!(problem instanceof RefusedError)) throw problem;
    return Response.json({ error: { code: problem.code, sentence: problem.sentence } }, { status: 409 });
  }
}

interface Case {
  editor: EditorName;
  /** Begin to keep; returns what tells whether all is kept, and what ends it. */
  start: () => Promise<{ isKept: () => boolean; end: () => void }> | { isKept: () => boolean; end: () => void };
  /** What the user does about it, where nothing happens by itself. */
  act?: () => Promise<unknown>;
}

const byKeeper = (keeper: Keeper) => {
  const end = keeper.start();
  return { isKept: () => keeper.isKept, end };
};
const pairWindow = (editor: EditorName): Case => ({
  editor,
  start: () => {
    usePair.setState({ me: "me", view: { name: "Ours", owners: { [editor]: "me" }, joined: true, versions: {} } as never });
    return byKeeper(new PairWindow(editor, { project: {}, version: 0 } as never, { id: "1", isFilling: false, isOver: true }).keeper);
  },
});

let endAutosave: (() => void) | null = null;
const CASES: Record<string, Case> = {
  autosave: {
    editor: "leader",
    start: async () => {
      await autosave.find();
      // It lasts as long as the page.
      endAutosave ??= autosave.start();
      return { isKept: () => !asks(), end: () => undefined };
    },
  },
  "a class's draft": { editor: "leader", start: () => byKeeper(new Keeper(draft, 2000, 5000)) },
  "a pair's window of the leader": pairWindow("leader"),
  "a pair's window of the followers": pairWindow("followers"),
  "the library": {
    editor: "leader",
    start: () => {
      markSaved();
      return { isKept: () => !useStudio.getState().unsaved, end: () => undefined };
    },
    act: () => library.save().catch(() => undefined),
  },
};

/** Whether the browser would ask who leaves the page. */
const asks = () => !window.dispatchEvent(new Event("beforeunload", { cancelable: true }));
const others = () => Object.keys(localStorage).map((key) => localStorage.getItem(key)!);

await startTexts(texts);
library.watch();
afterAll(() => {
  endAutosave?.();
  localStorage.clear();
  sessionStorage.clear();
  usePair.setState({ me: "", view: null });
});

describe.each(Object.entries(CASES))("%s", (name, { editor, start, act }) => {
  // The browser's storage keeps the work beside each other place.
  const isSomewhere = (work: number) => (name === "autosave" ? others() : held).some((text) => text.includes(`"work":${work}}`));
  let kept: Awaited<ReturnType<Case["start"]>>;
  const settle = async () => {
    if (act) void act();
    await vi.advanceTimersByTimeAsync(10_000);
  };
  const edit = (work: number) => useStudio.setState({ [editor]: { blocks: { work } } });
  /** Storage of the browser that has no room. */
  const fillUp = () =>
    vi.spyOn(Storage.prototype, "setItem").mockImplementation(() => {
      throw new DOMException("The quota has been exceeded.", "QuotaExceededError");
    });

  beforeEach(async () => {
    vi.useFakeTimers();
    mode = "ok";
    held = [];
    localStorage.clear();
    vi.stubGlobal("fetch", classServer);
    const ask = (request: string, message: unknown) => (request === "projects/write" ? reply(JSON.stringify(message)) : Promise.resolve([]));
    connectTo({ ask: ask, openStream: vi.fn() });
    useStudio.setState({ name: "Mine", leader: {}, followers: {}, kept: null, unsaved: false });
    const beginning = start();
    await vi.advanceTimersByTimeAsync(1000);
    kept = await beginning;
  });
  afterEach(() => {
    kept.end();
    vi.restoreAllMocks();
    vi.unstubAllGlobals();
    vi.useRealTimers();
  });

  it("keeps the newest of many changes", async () => {
    edit(1);
    edit(2);
    await settle();
    expect(isSomewhere(2)).toBe(true);
    expect(kept.isKept()).toBe(true);
  });

  it("keeps what could not be written, once it can", async () => {
    const full = name === "autosave" ? fillUp() : null;
    mode = "gone";
    edit(1);
    await settle();
    expect(isSomewhere(1)).toBe(false);
    if (name !== "autosave") expect(kept.isKept()).toBe(false);
    full?.mockRestore();
    mode = "ok";
    // Storage of the browser says nothing when it has room again.
    if (name === "autosave") edit(2);
    await settle();
    expect(isSomewhere(name === "autosave" ? 2 : 1)).toBe(true);
    expect(kept.isKept()).toBe(true);
  });

  it("loses nothing where there is no room, and keeps the next change", async () => {
    const full = name === "autosave" ? fillUp() : null;
    mode = "full";
    edit(1);
    useStudio.setState({ unsaved: true });
    await settle();
    expect(isSomewhere(1)).toBe(false);
    // Who leaves is asked, or the page says that it isn't saved.
    if (name === "autosave") expect(asks()).toBe(true);
    expect(useStudio.getState().unsaved).toBe(true);
    full?.mockRestore();
    mode = "ok";
    edit(2);
    await settle();
    expect(isSomewhere(2)).toBe(true);
  });

  it("keeps the last change when the tab is closed, or the page says that it isn't saved", async () => {
    edit(3);
    window.dispatchEvent(new Event("pagehide"));
    await vi.advanceTimersByTimeAsync(0);
    expect(isSomewhere(3) || useStudio.getState().unsaved).toBe(true);
  });

  it("keeps this tab's work and another's, where another has taken the place", async () => {
    edit(4);
    await settle();
    const theirs = '{"leader":{},"followers":null,"profile":"classroom","at":1,"theirs":true}';
    if (name === "autosave") localStorage.setItem(own.place, theirs);
    mode = "taken";
    // What a window refuses goes to the library, which takes it.
    if (name.startsWith("a pair")) vi.stubGlobal("fetch", (path: string, asked: { body: string }) => classServer(path, asked).finally(() => (mode = "ok")));
    edit(5);
    await settle();
    if (name === "autosave") expect(others()).toContain(theirs);
    if (act) {
      // The user doesn't want a next version yet.
      useQuestion.getState().question!.answer("no");
      await vi.advanceTimersByTimeAsync(0);
      expect(useStudio.getState().unsaved).toBe(true);
    }
    mode = "ok";
    // A draft is written again with the next edit.
    if (name === "a class's draft") edit(5);
    await settle();
    expect(isSomewhere(5)).toBe(true);
  });

  it("a late answer says nothing about what has changed since", async () => {
    mode = "late";
    edit(7);
    await settle();
    edit(8);
    mode = "ok";
    answerLate();
    await vi.advanceTimersByTimeAsync(0);
    if (act) expect(useStudio.getState().unsaved).toBe(true);
    await settle();
    expect(isSomewhere(8)).toBe(true);
    expect(kept.isKept()).toBe(true);
  });
});
