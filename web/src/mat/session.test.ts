import { beforeEach, expect, it, vi } from "vitest";
import { connectTo, type StreamListeners } from "../api/service";
import type { CompiledWord } from "../api/types";
import { columnBytes, HEADER, HEADER_BYTES } from "../generated/world";
import { useStudio } from "../state/studio";
import type { Mat } from "./document";
import { runningBlocks, sameRunning } from "./account";
import { Session } from "./session";
import { endEdit, forgetEdits, redo as redoEdit, undo as undoEdit, useHistory } from "../state/history";
import { editMat, useMat } from "./store";
import { pictureOf } from "./testPictures";

const WORDS: CompiledWord[] = [
  { hex: "01020100", part: "header", block: null },
  { hex: "62000000", part: "leader", block: "drive" },
  { hex: "a0000000", part: "followers", block: "turn" },
  { hex: "a1000000", part: "followers", block: "both", fields_of: { motor_speed: "move", led_which: "shine" } },
];

it("several blocks run at once, in both editors", () => {
  const running = runningBlocks(pictureOf([{ index: 1 }, { index: 2 }, { index: 3 }, { index: 2 }]), WORDS);
  expect(running.get("leader")).toEqual(["drive"]);
  expect(running.get("followers")).toEqual(["both", "move", "shine", "turn"]);
});

it("a word that is over, none, and one that the page no longer has run nothing", () => {
  const running = runningBlocks(pictureOf([{ index: 1, flags: 0 }, {}, { index: 9 }]), WORDS);
  expect([...running.values()].flat()).toEqual([]);
});

it("the same blocks are the same, whichever cars run them", () => {
  const one = runningBlocks(pictureOf([{ index: 1 }, { index: 2 }]), WORDS);
  const other = runningBlocks(pictureOf([{ index: 2 }, { index: 1 }]), WORDS);
  expect(sameRunning(one, other)).toBe(true);
  expect(sameRunning(one, runningBlocks(pictureOf([{ index: 1 }]), WORDS))).toBe(false);
});

/** A session, what it has sent, and its page's end of the stream. */
function opened() {
  const sent: { do: string }[] = [];
  let page: StreamListeners | null = null;
  connectTo({
    ask: vi.fn(),
    openStream: (_, __, listeners) => {
      page = listeners;
      return { send: (data) => sent.push(JSON.parse(data as string) as { do: string }) > 0, close: vi.fn() };
    },
  });
  const session = new Session();
  session.open();
  const hello = (cars: number, resumed = false) => page!.onMessage(JSON.stringify({ is: "hello", session: session.name, resumed, cars }));
  const picture = (frame: number, cars: number) => {
    const view = new DataView(new ArrayBuffer(HEADER_BYTES + columnBytes(cars)));
    view.setUint8(HEADER.kind, 1);
    view.setUint32(HEADER.number, frame, true);
    view.setUint32(HEADER.cars, cars, true);
    page!.onMessage(view.buffer);
  };
  const state = (playing: boolean, t_ms = 5000) => page!.onMessage(JSON.stringify({ is: "state", playing, speed: 1, seed: 0, t_ms, shown_ms: null }));
  const over = () => page!.onMessage(JSON.stringify({ is: "goals", is_over: true, goals: [] }));
  const end = () => session.close();
  return { session, sent, hello, picture, state, over, end };
}

it("pictures that are never drawn are told as drawn: the server waits for each", () => {
  const { sent, hello, picture, end } = opened();
  const told = () => sent.filter((message) => message.do === "shown");
  hello(2);
  picture(1, 2);
  picture(2, 2);
  expect(told()).toEqual([]);
  // Another world comes before a stage was there to draw them.
  hello(3);
  expect(told()).toEqual([{ do: "shown", frame: 2 }]);
  picture(3, 2);
  expect(told().at(-1)).toEqual({ do: "shown", frame: 3 });
  end();
});

it("a world that runs on after a reload doesn't begin anew, however late its program is compiled", () => {
  vi.useFakeTimers();
  const program = { image: "AAAA", words: [] } as never;
  useStudio.setState({ compiled: program });
  const first = opened();
  first.hello(0);
  expect(first.sent.map((message) => message.do)).toEqual(["set"]);
  first.end();
  useStudio.setState({ compiled: null });
  const reloaded = opened();
  reloaded.hello(2, true);
  vi.advanceTimersByTime(60_000);
  useStudio.setState({ compiled: program });
  vi.advanceTimersByTime(1000);
  expect(reloaded.sent.map((message) => message.do)).not.toContain("set");
  reloaded.end();
  useStudio.setState({ compiled: null });
  vi.useRealTimers();
});

it("a world that plays while its page is reloaded plays on, also with a newer program", () => {
  vi.useFakeTimers();
  const page = opened();
  page.hello(2, true);
  page.state(true);
  useStudio.setState({ compiled: { image: "NEWR", words: [] } as never });
  vi.advanceTimersByTime(1000);
  expect(page.sent.map((message) => message.do)).toEqual(["set", "play"]);
  page.end();
  useStudio.setState({ compiled: null });
  useMat.setState({ hello: null, state: null, play: "nothing" });
  vi.useRealTimers();
});

it("a first world plays when it has its program, and stands until then", () => {
  vi.useFakeTimers();
  useStudio.setState({ isOpening: true });
  const page = opened();
  page.hello(0);
  vi.advanceTimersByTime(1000);
  expect(page.sent.map((message) => message.do)).toEqual(["set"]);
  // Of the world before.
  page.state(true);
  page.state(false);
  useStudio.setState({ compiled: { image: "AAAA", words: [] } as never });
  vi.advanceTimersByTime(1000);
  expect(page.sent.slice(1).map((message) => message.do)).toEqual(["set", "play"]);
  page.end();
  useStudio.setState({ isOpening: false, compiled: null });
  useMat.setState({ hello: null, state: null, play: "nothing" });
  vi.useRealTimers();
});

it("an edit plays on, another project stands at its beginning", () => {
  vi.useFakeTimers();
  const program = (image: string) => useStudio.setState({ compiled: { image, words: [] } as never });
  const plays = () => page.sent.slice(page.sent.findLastIndex(({ do: what }) => what === "set")).map((message) => message.do);
  program("AAAA");
  const page = opened();
  page.hello(2);
  page.session.play();
  page.state(true);
  program("BBBB");
  vi.advanceTimersByTime(1000);
  expect(plays()).toEqual(["set", "play"]);
  page.session.stand();
  program("CCCC");
  // The world before still plays, as far as the page knows.
  vi.advanceTimersByTime(1000);
  expect(plays()).toEqual(["set"]);
  // Even where it is the same one.
  const sets = () => page.sent.filter((message) => message.do === "set").length;
  const before = sets();
  page.session.stand();
  vi.advanceTimersByTime(1000);
  expect(sets()).toBe(before + 1);
  page.session.play();
  program("DDDD");
  vi.advanceTimersByTime(1000);
  expect(plays()).toEqual(["set", "play"]);
  page.end();
  useStudio.setState({ compiled: null });
  useMat.setState({ hello: null, state: null, play: "nothing" });
  vi.useRealTimers();
});

/** A page of a pair, whose world plays, and what it has told the other one. */
function conducting() {
  vi.useFakeTimers();
  useStudio.setState({ compiled: { image: "AAAA", words: [] } as never });
  const page = opened();
  const told: { playing: boolean; t_ms: number }[] = [];
  page.session.onCommand = ({ playing, t_ms }) => told.push({ playing, t_ms });
  page.hello(2);
  const end = () => {
    page.end();
    useStudio.setState({ compiled: null });
    useMat.setState({ hello: null, state: null, goals: null, play: "nothing" });
    vi.useRealTimers();
  };
  return { ...page, told, end };
}

it("the partner's page is told how the world plays, also of a new run and of the end, but not of what it has said itself", () => {
  const page = conducting();
  page.session.play();
  // Sent before the world heard of it.
  page.state(false, 0);
  page.state(true, 0);
  useStudio.setState({ compiled: { image: "BBBB", words: [] } as never });
  vi.advanceTimersByTime(1000);
  page.hello(2);
  page.state(true, 10);
  page.state(false, 5000);
  page.over();
  page.over();
  expect(page.told).toEqual([{ playing: true, t_ms: 0 }, { playing: true, t_ms: 10 }, { playing: false, t_ms: 5000 }]);
  page.sent.length = 0;
  page.session.follow({ playing: false, speed: 1, seed: 0, t_ms: 5000 });
  expect(page.sent).toEqual([]);
  page.end();
});

it("who follows late catches up, however far the other one is, and with what has passed until the own world stood", () => {
  const page = conducting();
  page.state(false, 0);
  for (const [t_ms, sent] of [
    [100_000, [{ do: "reset", seed: 0, until_ms: 101_000 }]],
    [0, [...Array<object>(10).fill({ do: "step", ticks: 100 })]],
  ] as const) {
    page.sent.length = 0;
    page.session.follow({ playing: true, speed: 2, seed: 0, t_ms });
    vi.advanceTimersByTime(500);
    page.state(false, 0);
    expect(page.sent).toEqual([{ do: "pause" }, ...sent, { do: "play", speed: 2 }]);
  }
  page.end();
});

const named = (name: string): Mat => ({ format: "motorcade-mat/1", name });
const name = () => useStudio.getState().mat.name;

beforeEach(() => {
  useStudio.setState({ mat: named("first") });
  forgetEdits();
});

it("edits are undone one by one, and redone", () => {
  editMat(named("second"));
  editMat(named("third"));
  undoEdit();
  expect(name()).toBe("second");
  undoEdit();
  undoEdit();
  expect(name()).toBe("first");
  redoEdit();
  redoEdit();
  expect(name()).toBe("third");
});

it("a drag's steps are undone together, two drags are not", () => {
  for (const step of ["a", "b", "c"]) editMat(named(step), "move disc 0");
  endEdit();
  for (const step of ["d", "e"]) editMat(named(step), "move disc 0");
  undoEdit();
  expect(name()).toBe("c");
  undoEdit();
  expect(name()).toBe("first");
});

it("a new edit ends what could be redone, and another document all", () => {
  editMat(named("second"));
  undoEdit();
  editMat(named("other"));
  redoEdit();
  expect(name()).toBe("other");
  useStudio.setState({ mat: named("opened") });
  forgetEdits();
  undoEdit();
  expect(name()).toBe("opened");
});

it("the past is bounded", () => {
  for (let k = 0; k < 600; k++) editMat(named(String(k)));
  expect(useHistory.getState().done.length).toBe(500);
});
