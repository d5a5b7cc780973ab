import { afterAll, afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import { useDialogs } from "../state/dialogs";
import { own } from "../state/otherTabs";
import { useStudio } from "../state/studio";
import { autosave, leftOpening, parseWork, workOf } from "./autosave";

describe("the stored work", () => {
  it("is the whole project and what was put aside", () => {
    const studio = { ...useStudio.getState(), name: "三", leader: { blocks: {} }, parkedFollowers: { blocks: { a: 1 } } };
    const stored = parseWork(JSON.stringify(workOf(studio, 5)));
    expect(stored).toMatchObject({ name: "三", leader: { blocks: {} }, parkedFollowers: { blocks: { a: 1 } }, at: 5 });
  });

  it.each([null, "", "{", "[]", "7", '{"leader": 1}', '{"leader": {}, "followers": [], "profile": "c", "at": 1}', '{"leader": {}, "followers": null, "profile": "c", "at": 1, "mat": 5}'])(
    "is left alone where it is %s",
    (text) => expect(parseWork(text)).toBeNull(),
  );
});

/** Whether the browser would ask who leaves the page. */
const asks = () => !window.dispatchEvent(new Event("beforeunload", { cancelable: true }));

describe("autosave", () => {
  const stored = () => parseWork(localStorage.getItem(own.place));
  beforeEach(() => void vi.useFakeTimers());
  afterEach(() => void vi.useRealTimers());
  let end: () => void;
  afterAll(() => end());

  it("keeps a change shortly after it, and the newest of many", async () => {
    localStorage.clear();
    await autosave.find();
    end = autosave.start();
    useStudio.setState({ leader: { blocks: { first: true } } });
    vi.advanceTimersByTime(200);
    useStudio.setState({ leader: { blocks: { second: true } }, unsaved: true });
    expect(stored()).toBeNull();
    vi.advanceTimersByTime(300);
    expect(stored()).toMatchObject({ leader: { blocks: { second: true } }, unsaved: true });
    expect(asks()).toBe(false);
  });

  it("keeps what a first visit finds, and says so until somebody changes it", () => {
    end();
    useStudio.setState({ isOpening: true, unsaved: false });
    end = autosave.start();
    vi.advanceTimersByTime(500);
    expect([stored()?.isOpening, leftOpening()]).toEqual([true, true]);
    useStudio.setState({ unsaved: true });
    vi.advanceTimersByTime(500);
    expect([stored()?.isOpening, leftOpening()]).toEqual([false, false]);
    useStudio.setState({ isOpening: false });
  });

  it("keeps what is under way when the page is left", () => {
    useStudio.setState({ name: "last change" });
    window.dispatchEvent(new Event("pagehide"));
    expect(stored()?.name).toBe("last change");
  });

  it("says once that the browser has no room, and asks who leaves, until it has", () => {
    const full = vi.spyOn(Storage.prototype, "setItem").mockImplementation(() => {
      throw new DOMException("The quota has been exceeded.", "QuotaExceededError");
    });
    useDialogs.setState({ notices: [] });
    for (const name of ["one", "two"]) {
      useStudio.setState({ name });
      vi.advanceTimersByTime(500);
    }
    expect(asks()).toBe(true);
    full.mockRestore();
    expect(useDialogs.getState().notices).toHaveLength(1);
    useStudio.setState({ name: "three" });
    expect(asks()).toBe(false);
    expect(stored()?.name).toBe("three");
  });

  it("leaves its place to another page that has taken it, and keeps all its work at a new one", () => {
    const place = own.place;
    const others = JSON.stringify(workOf({ ...useStudio.getState(), name: "another's" }, 7));
    localStorage.setItem(place, others);
    useStudio.setState({ name: "four" });
    vi.advanceTimersByTime(500);
    expect(localStorage.getItem(place)).toBe(others);
    expect(own.place).not.toBe(place);
    expect(stored()?.name).toBe("four");
    // Before any change too, as soon as the browser tells of it.
    localStorage.setItem(own.place, others);
    window.dispatchEvent(new StorageEvent("storage", { key: own.place }));
    expect(stored()?.name).toBe("four");
  });
});

/** Channels between pages, each of which is a set of modules of its own here. */
class Channel {
  static all: Channel[] = [];
  onmessage: ((event: { data: unknown }) => void) | null = null;

  constructor() {
    Channel.all.push(this);
  }

  postMessage(data: unknown): void {
    for (const other of Channel.all) if (other !== this) other.onmessage?.({ data });
  }
}

describe("a tab's place", () => {
  const store = (name: string, at: number) => {
    localStorage.setItem(`motorcade.autosave.${name}`, JSON.stringify(workOf({ ...useStudio.getState(), name }, at)));
  };
  /** Open a page, in a tab of its own unless it `reloads` one. Returns its place, and what it shows. */
  const openPage = async ({ reloads = false, isCopy = false } = {}) => {
    if (!reloads && !isCopy) sessionStorage.clear();
    window.dispatchEvent(new Event(reloads ? "pagehide" : "pageshow"));
    vi.resetModules();
    const tabs = await import("../state/otherTabs");
    tabs.startOtherTabs();
    const work = await (await import("./autosave")).autosave.find();
    return { place: tabs.own.place, shows: work?.name, close: () => Channel.all.pop() };
  };

  beforeEach(() => {
    localStorage.clear();
    Channel.all = [];
    vi.stubGlobal("BroadcastChannel", Channel);
  });
  afterEach(() => void vi.unstubAllGlobals());

  it("is nobody else's: a second tab begins anew", async () => {
    store("first", 1);
    expect((await openPage()).shows).toBe("first");
    expect((await openPage()).shows).toBeUndefined();
  });

  it("is found again after a reload, also where another was used later", async () => {
    store("first", 1);
    (await openPage()).close();
    store("second", 2);
    expect((await openPage({ reloads: true })).shows).toBe("first");
  });

  it("goes on where a tab was closed or crashed, with the newest first", async () => {
    store("old", 1);
    store("new", 2);
    expect((await openPage()).shows).toBe("new");
    expect((await openPage()).shows).toBe("old");
  });

  it("is another one for a copy of the tab, which begins with the same work", async () => {
    store("first", 1);
    const { place } = await openPage();
    const copy = await openPage({ isCopy: true });
    expect(copy.shows).toBe("first");
    expect(copy.place).not.toBe(place);
  });
});
