import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import { useStudio } from "../app/store";
import { keepEveryChange, keptOf, parseKept, restoreKept } from "./autosave";

describe("what was kept", () => {
  it("is the whole project and what was put aside", () => {
    const studio = { ...useStudio.getState(), name: "三", leader: { blocks: {} }, parkedFollowers: { blocks: { a: 1 } } };
    const kept = parseKept(JSON.stringify(keptOf(studio, 5)));
    expect(kept).toMatchObject({ name: "三", leader: { blocks: {} }, parkedFollowers: { blocks: { a: 1 } }, at: 5 });
  });

  it.each([null, "", "{", "[]", "7", '{"leader": 1}', '{"leader": {}, "followers": [], "profile": "c", "at": 1}'])(
    "is left alone where it is %s",
    (text) => expect(parseKept(text)).toBeNull(),
  );
});

describe("autosave", () => {
  beforeEach(() => void vi.useFakeTimers());
  afterEach(() => void vi.useRealTimers());

  it("keeps a change shortly after it, and the newest of many", () => {
    keepEveryChange();
    useStudio.setState({ leader: { blocks: { first: true } } });
    vi.advanceTimersByTime(200);
    useStudio.setState({ leader: { blocks: { second: true } }, unsaved: true });
    expect(restoreKept()).toBeNull();
    vi.advanceTimersByTime(300);
    expect(restoreKept()).toMatchObject({ leader: { blocks: { second: true } }, unsaved: true });
  });

  it("keeps what is under way when the page is left", () => {
    useStudio.setState({ name: "last words" });
    window.dispatchEvent(new Event("pagehide"));
    expect(restoreKept()?.name).toBe("last words");
  });
});
