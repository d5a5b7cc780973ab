import { act, cleanup, render, screen, waitFor, within } from "@testing-library/react";
import userEvent from "@testing-library/user-event";
import { afterEach, beforeAll, describe, expect, it, vi } from "vitest";
import texts from "virtual:texts/class";
import { answerBy, Refusal } from "../api/testServer";
import type { ClassView, PupilRow } from "../generated/classroom";
import { say, startTexts } from "../i18n";
import { Page } from "../ui/page";
import { HowToJoin } from "./HowToJoin";
import { Join } from "./Join";
import { Privacy } from "./Privacy";
import { Report } from "./TeacherCheck";
import { ClassPart } from "./TeacherClass";
import { CarsPart } from "./TeacherDriving";
import { PupilsPart } from "./TeacherPupils";
import { HandOutPart } from "./TeacherHandOut";
import { Wall } from "./WallPage";

beforeAll(async () => {
  await startTexts(texts);
  // A page fetches it when it first asks something.
  await import("../ui/QuestionDialog");
});
afterEach(() => {
  cleanup();
  vi.unstubAllGlobals();
});

const MIA: PupilRow = {
  ...{ id: "1", name: "Mia", avatar: "bus", number: "0042", online: true, away_s: 0, hand_s: 90, stuck_s: null },
  ...{ mission: null, goals_met: 0, goals: 0, stars: 2 },
};
const ENTRY = { path: "swarm", mat: { format: "motorcade-mat/1", name: "" }, zones: [], stars: [1, 2], earned: [], minutes: 15 };
const VIEW = {
  ...{ is: "class", frozen: false, shared: [], stopped: false, mat: { state: "closed" }, title: "4b", code: "HQ6FCA", is_open: true, stuck_minutes: 5, disk: null },
  pupils: [MIA, { ...MIA, id: "2", name: "Ben", hand_s: null }],
} as unknown as ClassView;
const ABOUT = { me: null, is_open: true, avatars: ["bus", "taxi"], title: "4b" };

const fill = async (user: ReturnType<typeof userEvent.setup>, name: RegExp, text: string) => {
  const field = await screen.findByLabelText(name);
  await user.clear(field);
  await user.type(field, text);
};

describe("who joins", () => {
  it("is told of a wrong code, and gets a number for coming back after the name", async () => {
    const user = userEvent.setup({ delay: null });
    const asked = answerBy({
      "/api/class/about": () => ABOUT,
      "/api/class/check-code": ({ code }: { code: string }) => (code === "HQ6FCA" ? {} : new Refusal("wrong-class-code", "This is another code.")),
      "/api/class/join": ({ name, avatar }: { name: string; avatar: string }) => ({ id: "1", name, avatar, number: "0042" }),
    });
    render(<Join />);
    const next = await screen.findByRole("button", { name: "Next" });
    expect(next.matches(":disabled")).toBe(true);
    await fill(user, /code/i, "AAAAAA{Enter}");
    expect((await screen.findByText("This is another code.")).getAttribute("role")).toBe("alert");
    await fill(user, /code/i, "HQ6FCA{Enter}");
    await user.click(await screen.findByRole("radio", { name: /2/ }));
    await fill(user, /nickname/i, "Mia{Enter}");
    expect((await screen.findByText("0042")).tagName).toBe("P");
    expect(asked.at(-1)).toEqual(["/api/class/join", { code: "HQ6FCA", name: "Mia", avatar: "taxi" }]);
  });

  it("comes back by name and number; a code that was changed meanwhile is asked for again", async () => {
    const user = userEvent.setup({ delay: null });
    answerBy({
      "/api/class/about": () => ABOUT,
      "/api/class/check-code": () => ({}),
      "/api/class/return": () => new Refusal("wrong-class-code", "The code is a new one."),
    });
    render(<Join />);
    await fill(user, /code/i, "HQ6FCA{Enter}");
    await user.click(await screen.findByRole("button", { name: "I was here before" }));
    await fill(user, /nickname/i, "Mia");
    await fill(user, /number/i, "004");
    expect(screen.getByRole("button", { name: "Come in" }).matches(":disabled")).toBe(true);
    await fill(user, /number/i, "0042{Enter}");
    expect(await screen.findByText("The code is a new one.")).toBeTruthy();
    expect(screen.getByLabelText<HTMLInputElement>(/code/i).value).toBe("HQ6FCA");
  });
});

describe("the teacher", () => {
  it("chooses the address that the QR code leads to", async () => {
    const user = userEvent.setup({ delay: null });
    const both = ["http://10.0.0.7/", "http://192.168.0.2/"];
    const found = (addresses: string[]) => ({ code: "HQ6FCA", addresses, local_name: null, why_no_name: null, qr_code: `<svg>${addresses[0]}</svg>` });
    const asked = answerBy({
      "/api/teacher/addresses": () => found(both),
      "/api/teacher/choose-address": ({ address }: { address: string }) => found([address, ...both.filter((other) => other !== address)]),
    });
    render(<HowToJoin view={VIEW} canChange />);
    await user.click(await screen.findByRole("radio", { name: both[1] }));
    expect(asked.at(-1)).toEqual(["/api/teacher/choose-address", { address: both[1] }]);
    await waitFor(() => expect(screen.getByRole("img").getAttribute("src")).toContain(encodeURIComponent(both[1]!)));
    expect(screen.getAllByRole<HTMLInputElement>("radio").map(({ checked }) => checked)).toEqual([true, false]);
  });

  it("sees how pupils join as long as nobody is here", async () => {
    answerBy({ "/api/teacher/addresses": () => ({ code: "HQ6FCA", addresses: ["http://10.0.0.7/"], local_name: null, why_no_name: null, qr_code: "<svg/>" }) });
    render(<PupilsPart view={{ ...VIEW, pupils: [] }} />);
    expect(await screen.findByText("http://10.0.0.7/")).toBeTruthy();
    expect(screen.getByRole("img", { name: /QR/ })).toBeTruthy();
  });

  it("is asked before a pupil is removed, and before the class ends", async () => {
    const user = userEvent.setup({ delay: null });
    const asked = answerBy({ "/api/teacher/remove": () => ({}), "/api/teacher/end": () => ({}), "/api/teacher/addresses": () => new Refusal("x", "none") });
    render(
      <Page title="">
        <PupilsPart view={VIEW} />
        <ClassPart view={VIEW} />
      </Page>,
    );
    const removals = () => asked.filter(([path]) => path.endsWith("remove"));
    await user.click(screen.getAllByRole("button", { name: "Remove from the class", hidden: true })[0]!);
    await user.click(await screen.findByRole("button", { name: "Cancel" }));
    expect(removals()).toEqual([]);
    await user.click(screen.getAllByRole("button", { name: "Remove from the class", hidden: true })[0]!);
    await user.click(within(await screen.findByRole("alertdialog")).getByRole("button", { name: "Remove from the class" }));
    await waitFor(() => expect(removals()).toEqual([["/api/teacher/remove", { pupil: "1" }]]));
    await user.type(screen.getByLabelText("Password"), "long enough");
    await user.click(screen.getByRole("button", { name: "End the class" }));
    await user.click(within(await screen.findByRole("alertdialog")).getByRole("button", { name: "End the class" }));
    expect(await screen.findByText(say("class.classEnded"))).toBeTruthy();
    expect(asked.at(-1)).toEqual(["/api/teacher/end", { password: "long enough" }]);
  });

  it("hands a mission out to those who are ticked, or to all who were asked about, and hears whom it missed", async () => {
    const user = userEvent.setup({ delay: null });
    vi.stubGlobal("ResizeObserver", class { observe = vi.fn(); disconnect = vi.fn(); });
    const missions = [
      { ...ENTRY, id: "the-square", name: { en: "Four corners" }, path: "first-drive", order: 4 },
      { ...ENTRY, id: "follow-me", name: { en: "Everybody out" }, order: 1 },
    ];
    const asked = answerBy({
      "/api/missions": () => missions,
      "/api/projects/list": () => [],
      "/api/teacher/hand-out": () => ({ pupils: 1, missed: ["2"] }),
    });
    render(
      <Page title="">
        <HandOutPart view={VIEW} />
      </Page>,
    );
    await user.click(screen.getByRole("checkbox", { name: "Ben" }));
    await user.click(await screen.findByRole("button", { name: "4. Four corners" }));
    const paths = [say("missions.paths.first-drive"), say("missions.paths.swarm")];
    expect(screen.getAllByRole("heading", { level: 2 }).slice(2).map(({ textContent }) => textContent)).toEqual(paths);
    expect(screen.getAllByText(/15 min/)).toHaveLength(2);
    const given = () => asked.filter(([path]) => path.endsWith("hand-out")).map(([, message]) => message);
    expect(given()).toEqual([{ mission: { id: "the-square" }, to: ["2"] }]);
    expect((await screen.findByText(/Ben/, { selector: "[role=status]" })).textContent).toContain("Four corners");
    await user.click(screen.getByRole("radio", { name: "All" }));
    await user.click(screen.getByRole("button", { name: "4. Four corners" }));
    await user.click(await screen.findByRole("button", { name: "Cancel" }));
    expect(given()).toHaveLength(1);
    await user.click(screen.getByRole("button", { name: "4. Four corners" }));
    await user.click(within(await screen.findByRole("alertdialog")).getByRole("button", { name: say("class.handOut") }));
    await waitFor(() => expect(given()).toHaveLength(2));
    expect(given()[1]).toEqual({ mission: { id: "the-square" }, to: null });
  });

  it("finds lessons with their steps, and hands out a mission of one", async () => {
    const user = userEvent.setup({ delay: null });
    vi.stubGlobal("ResizeObserver", class { observe = vi.fn(); disconnect = vi.fn(); });
    const asked = answerBy({
      "/api/missions": () => [{ ...ENTRY, id: "pass-it-on", name: { en: "Pass it on" }, order: 3 }],
      "/api/projects/list": () => [],
      "/api/teacher/hand-out": () => ({ pupils: 2, missed: [] }),
    });
    render(<HandOutPart view={VIEW} />);
    await user.click(screen.getByRole("checkbox", { name: "Ben" }));
    const lessons = within(await screen.findByRole("region", { name: say("class.lessons") }));
    await user.click(lessons.getByText(say("class.lesson.second")));
    expect(lessons.getByText(/Whisper a word/).tagName).toBe("LI");
    await user.click(await lessons.findByRole("button", { name: "Pass it on" }));
    expect(asked.at(-1)).toEqual(["/api/teacher/hand-out", { mission: { id: "pass-it-on" }, to: ["2"] }]);
  });

  it("types after how many minutes a pupil is stuck: the field shows what is typed", async () => {
    const user = userEvent.setup({ delay: null });
    const asked = answerBy({ "/api/teacher/settings": () => ({}), "/api/teacher/addresses": () => new Refusal("x", "none") });
    render(<ClassPart view={VIEW} />);
    const minutes = screen.getByRole<HTMLInputElement>("spinbutton");
    await user.clear(minutes);
    expect(minutes.value).toBe("");
    await user.type(minutes, "12");
    expect(minutes.value).toBe("12");
    expect(asked.at(-1)).toEqual(["/api/teacher/settings", { stuck_minutes: 12 }]);
  });

  it("is not told that the chosen project is wrong by what comes late of another one", async () => {
    const user = userEvent.setup({ delay: null });
    let compileFirst: (compiled: unknown) => void = () => undefined;
    const compiled = [new Promise((resolve) => (compileFirst = resolve)), { image: "right" }];
    const asked = answerBy({
      "/api/projects/list": () => [{ name: "One" }, { name: "Two" }],
      "/api/projects/read": () => ({ leader: {}, followers: null, profile: "classroom" }),
      "/api/compile": () => compiled.shift(),
    });
    vi.stubGlobal("WebSocket", class extends EventTarget { close = vi.fn(); });
    render(<CarsPart view={VIEW} />);
    const projects = screen.getByRole("combobox", { name: say("class.carProject") });
    await screen.findByRole("option", { name: "Two" });
    for (const name of ["One", "Two"]) {
      const before = asked.length;
      await user.selectOptions(projects, name);
      await waitFor(() => expect(asked).toHaveLength(before + 2));
    }
    compileFirst({ image: null });
    // Behind all that follows from it.
    await act(() => new Promise((resolve) => setTimeout(resolve)));
    expect(screen.queryByText(say("class.wrongProject", { name: "Two" }))).toBeNull();
  });

  it("reads on the projector's page why it is empty where nothing answers", async () => {
    vi.stubGlobal("fetch", () => Promise.reject(new TypeError("Failed to fetch")));
    render(<Wall />);
    expect(await screen.findByText(say("class.noAnswer"))).toBeTruthy();
  });

  it("sees that a report is being made, and asks for no second one meanwhile", async () => {
    const user = userEvent.setup({ delay: null });
    let made: (page: string) => void = () => undefined;
    const page = new Promise((resolve) => (made = resolve));
    answerBy({ "/api/teacher/report.html?language=en": () => page });
    Object.assign(URL, { createObjectURL: () => "blob:", revokeObjectURL: () => undefined });
    render(<Report missions={[{ id: "the-square", name: { en: "Four corners" } } as never]} />);
    const button = screen.getByRole("button", { name: say("class.checkReport") });
    await user.click(button);
    expect(screen.getByRole("status").textContent).not.toBe("");
    expect(button.matches(":disabled")).toBe(true);
    made("<p>");
    await waitFor(() => expect(button.matches(":disabled")).toBe(false));
    expect(screen.getByRole("status").textContent).toContain("the-square-report.html");
  });
});

it("from what the class stores one comes back to where one was, a teacher to the teacher's page", async () => {
  const user = userEvent.setup({ delay: null });
  const back = vi.spyOn(history, "back").mockReturnValue();
  history.pushState(null, "", "/privacy");
  render(<Privacy />);
  await user.click(screen.getByRole("link", { name: say("class.back") }));
  expect(back).toHaveBeenCalledTimes(1);
  back.mockRestore();
  history.replaceState(null, "", "/");
});
