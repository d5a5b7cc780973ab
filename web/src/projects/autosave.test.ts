import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import { useDialogs } from "../state/dialogs";
import { useStudio } from "../state/studio";
import { findWork, storeEveryChange, workOf, parseWork } from "./autosave";

describe("the stored work", () => {
  it("is the whole project and what was put aside", () => {
    const studio = { ...useStudio.getState(), name: "三", leader: { blocks: {} }, parkedFollowers: { blocks: { a: 1 } } };
    const stored = parseWork(JSON.stringify(workOf(studio, 5)));
    expect(stored).toMatchObject({ name: "三", leader: { blocks: {} }, parkedFollowers: { blocks: { a: 1 } }, at: 5 });
  });

  it.each([null, "", "{", "[]", "7", '{"leader": 1}', '{"leader": {}, "followers": [], "profile": "c", "at": 1}'])(
    "is left alone where it is %s",
    (text) => expect(parseWork(text)).toBeNull(),
  );
});

describe("autosave", () => {
  const KEY = "motorcade.autosave.here";
  const stored = () => parseWork(localStorage.getItem(KEY));
  beforeEach(() => void vi.useFakeTimers());
  afterEach(() => void vi.useRealTimers());

  it("keeps a change shortly after it, and the newest of many", () => {
    storeEveryChange(KEY);
    useStudio.setState({ leader: { blocks: { first: true } } });
    vi.advanceTimersByTime(200);
    useStudio.setState({ leader: { blocks: { second: true } }, unsaved: true });
    expect(stored()).toBeNull();
    vi.advanceTimersByTime(300);
    expect(stored()).toMatchObject({ leader: { blocks: { second: true } }, unsaved: true });
  });

  it("keeps what is under way when the page is left", () => {
    useStudio.setState({ name: "last change" });
    window.dispatchEvent(new Event("pagehide"));
    expect(stored()?.name).toBe("last change");
  });

  it("says once that the browser has no room", () => {
    const full = vi.spyOn(Storage.prototype, "setItem").mockImplementation(() => {
      throw new DOMException("The quota has been exceeded.", "QuotaExceededError");
    });
    useDialogs.setState({ notices: [] });
    for (const name of ["one", "two"]) {
      useStudio.setState({ name });
      vi.advanceTimersByTime(500);
    }
    full.mockRestore();
    expect(useDialogs.getState().notices).toHaveLength(1);
    useStudio.setState({ name: "three" });
    vi.advanceTimersByTime(500);
    expect(stored()?.name).toBe("three");
  });
});

/** The browser's locks, as several tabs see them. */
function locksOf(held: Set<string>): LockManager {
  const request = (name: string, { signal }: LockOptions, got: (lock: Lock | null) => Promise<never> | undefined) => {
    if (!held.has(name)) {
      held.add(name);
      void got({ name, mode: "exclusive" });
    } else if (signal) return Promise.reject(new DOMException("it took too long", "TimeoutError"));
    else void got(null);
    return new Promise<never>(() => undefined);
  };
  return { request } as unknown as LockManager;
}

describe("a tab's place", () => {
  const held = new Set<string>();
  const store = (name: string, at: number) => {
    localStorage.setItem(`motorcade.autosave.${name}`, JSON.stringify(workOf({ ...useStudio.getState(), name }, at)));
  };
  const found = async () => (await findWork()).stored?.name;

  beforeEach(() => {
    localStorage.clear();
    sessionStorage.clear();
    held.clear();
    Object.defineProperty(navigator, "locks", { value: locksOf(held), configurable: true });
  });

  it("is nobody else's: a second tab begins anew", async () => {
    store("first", 1);
    expect(await found()).toBe("first");
    sessionStorage.clear();
    expect(await found()).toBeUndefined();
  });

  it("is found again after a reload, also where another was used later", async () => {
    store("first", 1);
    const { key } = await findWork();
    store("second", 2);
    held.delete(key);
    expect(await found()).toBe("first");
  });

  it("goes on where a tab was closed or crashed, with the newest first", async () => {
    store("old", 1);
    store("new", 2);
    expect(await found()).toBe("new");
    sessionStorage.clear();
    expect(await found()).toBe("old");
  });

  it("is another one for a copy of the tab, which begins with the same work", async () => {
    store("first", 1);
    const { key } = await findWork();
    const copy = await findWork();
    expect(copy.stored?.name).toBe("first");
    expect(copy.key).not.toBe(key);
  });
});
