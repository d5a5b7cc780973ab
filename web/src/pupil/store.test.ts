import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import { own } from "../state/otherTabs";
import { findPupilsWork, lookingIn } from "./store";

describe("the address of a pupil's project", () => {
  it.each([
    ["?pupil=01&project=Robot", { pupil: "01", project: "Robot" }],
    ["?pupil=01&project=", { pupil: "01", project: "" }],
    ["?pupil=01", { pupil: "01", project: "" }],
    [`?${new URLSearchParams({ pupil: "02", project: "a&b=#?舞" }).toString()}`, { pupil: "02", project: "a&b=#?舞" }],
    ["", null],
    ["?project=Robot", null],
    ["?pupil=&project=Robot", null],
  ])("%s", (search, expected) => expect(lookingIn(search)).toEqual(expected));
});

describe("a pupil's newest work", () => {
  const project = { leader: {}, followers: null, profile: "classroom" };
  const here = "motorcade.class.01.here";
  const store = (place: string, name: string, at: number) => localStorage.setItem(place, JSON.stringify({ ...project, name, at }));
  let draft = {};

  beforeEach(() => {
    localStorage.clear();
    sessionStorage.clear();
    sessionStorage.setItem("motorcade.place", here);
    store(here, "mine", 1000);
    const answer = (path: string) => (path.endsWith("about") ? { me: { id: "01" } } : draft);
    vi.stubGlobal("fetch", (path: string) => Promise.resolve(Response.json(answer(path))));
  });
  afterEach(() => void vi.unstubAllGlobals());

  const found = async (place: string, seconds: number) => {
    draft = { name: "draft", project, saved_at: new Date(seconds * 1000).toISOString(), place };
    return (await findPupilsWork())?.name;
  };

  it("is the draft of this tab where that is newer", async () => {
    expect(await found(here, 2)).toBe("draft");
    expect(own.place).toBe(here);
    expect(await found(here, 0.5)).toBe("mine");
  });

  it("is the draft with its mission, as at another tablet", async () => {
    draft = { name: "draft", project, saved_at: new Date(2000).toISOString(), place: here, mission: { id: "the-square" } };
    expect((await findPupilsWork())?.mission).toEqual({ id: "the-square" });
  });

  it("is not the draft of another tab of this browser", async () => {
    store("motorcade.class.01.other", "theirs", 500);
    expect(await found("motorcade.class.01.other", 2)).toBe("mine");
  });

  it("is the newer draft of another device, and what lies here stays for another tab", async () => {
    expect(await found("motorcade.class.01.elsewhere", 2)).toBe("draft");
    expect(own.place).not.toBe(here);
    expect(localStorage.getItem(here)).toContain("mine");
  });
});
