/** On what a run stops, what is tried behind the page, and how a difference is told. */

import { afterAll, beforeEach, describe, expect, it, vi } from "vitest";
import texts from "virtual:texts/studio";
import { connectTo, type StreamListeners } from "../api/service";
import type { Difference, MeasuredCar, MissionZone, TrialMessage } from "../generated/messages";
import { startTexts } from "../i18n";
import { session } from "../mat/session";
import { useMat } from "../mat/store";
import { useDraft } from "../missions/draft";
import { useStudio } from "../state/studio";
import { differenceText } from "./Comparison";
import { addStop, canStopAt, nameOf, removeStop, tapZone, useStops, watchStops, zoneStop } from "./stops";
import { TrialStream, useTrials } from "./trials";

await startTexts(texts);

const WORDS = [
  { hex: "02020000", part: "header", block: null },
  { hex: "f4800000", part: "leader", block: "a" },
  { hex: "ec800000", part: "followers", block: "b" },
  { hex: "ec800000", part: "followers", block: "b" },
] as const;
const compiled = (image: string) => ({ image, words: [...WORDS], states: 1, follower_words: 0, diagnostics: [], left_out: [] }) as never;
const zone = (name: string, corners_m: number[][], centre_m: number[] | null = null): MissionZone => ({
  name,
  title: { en: name, zh: name },
  corners_m,
  centre_m,
  radius_m: centre_m && 0.5,
  avoid: false,
});

beforeEach(() => {
  useStops.setState(useStops.getInitialState());
  useTrials.setState(useTrials.getInitialState());
  useMat.setState(useMat.getInitialState());
  useStudio.setState({ compiled: compiled("AAAA"), mission: { id: "pass-it-on" }, capabilities: null });
});

// Other files' tests share these stores.
afterAll(() => {
  useStops.setState(useStops.getInitialState());
  useTrials.setState(useTrials.getInitialState());
  useMat.setState(useMat.getInitialState());
  useStudio.setState({ compiled: null, mission: null, capabilities: null });
  useDraft.setState({ draft: null });
});

describe("stops", () => {
  it("are sent to each new world, a block by the words that it makes now", () => {
    const send = vi.spyOn(session, "send").mockImplementation(() => undefined);
    const end = watchStops();
    addStop({ condition: { kind: "block" }, block: { editor: "followers", id: "b", text: "light" } });
    expect(send).not.toHaveBeenCalled();
    useMat.setState({ hello: { is: "hello", session: "", resumed: false, cars: 2 } });
    expect(send).toHaveBeenLastCalledWith({ do: "stop-when", conditions: [{ kind: "block", words: [2, 3] }] });
    addStop({ condition: { kind: "touch", car: 1 } });
    addStop({ condition: { kind: "touch", car: 1 } });
    expect(useStops.getState().stops.map(nameOf)).toHaveLength(2);
    removeStop(0);
    expect(send).toHaveBeenLastCalledWith({ do: "stop-when", conditions: [{ kind: "touch", car: 1 }] });
    end();
  });

  it("are for blocks that make words", () => {
    expect(canStopAt("a")).toBe("leader");
    expect(canStopAt("b")).toBe("followers");
    expect(canStopAt("hat")).toBeNull();
  });

  it("find the topmost zone under a point", () => {
    const square = zone("square", [[0, 0], [2, 0], [2, 2], [0, 2]]);
    const disc = zone("disc", [], [2, 1]);
    const tapped = (x: number, y: number) => {
      tapZone([x, y], [square, disc]);
      return useStops.getState().zone?.name;
    };
    expect([tapped(1, 1), tapped(1.8, 1), tapped(2.4, 1), tapped(3, 1), tapped(1, -0.1)]).toEqual(["square", "disc", "disc", undefined, undefined]);
    tapZone(null, [square, disc]);
    expect(useStops.getState().zone).toBeNull();
    expect(zoneStop(disc).condition).toEqual({ kind: "zone", name: "disc", disc: [2, 1, 0.5] });
    expect(zoneStop(square).condition.corners_m).toHaveLength(4);
  });
});

describe("trials", () => {
  const sent: TrialMessage[] = [];
  let listeners: StreamListeners;
  let closed = 0;

  beforeEach(() => {
    sent.length = closed = 0;
    connectTo({
      ask: () => Promise.reject(new Error("nothing is asked")),
      openStream: (_, __, page) => {
        listeners = page;
        return { send: (data) => Boolean(sent.push(JSON.parse(data as string) as TrialMessage)), close: () => (closed += 1) };
      },
    });
  });

  const playing = (is: boolean) => useMat.setState({ state: { playing: is } as never });
  const begin = () => {
    const stream = new TrialStream();
    const end = stream.watch();
    playing(true);
    listeners.onOpen();
    listeners.onMessage(JSON.stringify({ is: "luck", works: 18, tried: 20, of: 200, failed: [5, 9] }));
    return { stream, end };
  };

  it("begin when the cars drive, and end with the program", () => {
    const { end } = begin();
    expect(sent).toEqual([{ do: "try", mission: { id: "pass-it-on" }, image: "AAAA", runs: 200 }]);
    expect(useTrials.getState().luck?.works).toBe(18);
    playing(false);
    useStudio.setState({ compiled: compiled("BBBB") });
    expect(useTrials.getState().luck).toBeNull();
    expect(closed).toBe(1);
    // What ran before the edit can be compared with.
    expect(useTrials.getState().before?.image).toBe("AAAA");
    end();
  });

  it("keep the run before a change with the car that was measured", () => {
    const car = { speeds_mm_s: [0, 90, 150, 210], turn_rates_deg_s: [0, 40, 70, 100] } as MeasuredCar;
    useStudio.setState({ car });
    const { end } = begin();
    useStudio.setState({ compiled: compiled("BBBB"), car: null });
    expect(useTrials.getState().before?.car).toBe(car);
    end();
  });

  it("rest while somebody edits, though each edit lets the cars begin again", () => {
    vi.useFakeTimers();
    const { end } = begin();
    for (const image of ["BBBB", "CCCC"]) {
      useStudio.setState({ leader: { blocks: image } });
      useStudio.setState({ compiled: compiled(image) });
      // What was told of the program before means nothing any more.
      expect(useTrials.getState().luck).toBeNull();
      playing(false);
      playing(true);
      vi.advanceTimersByTime(1000);
    }
    expect(sent.length).toBe(1);
    vi.advanceTimersByTime(500);
    listeners.onOpen();
    expect(sent.map((each) => each.do === "try" && each.image)).toEqual(["AAAA", "CCCC"]);
    end();
    vi.useRealTimers();
  });

  it("rest as soon as somebody touches or changes the blocks, and begin anew where the program is the same", () => {
    vi.useFakeTimers();
    const { end } = begin();
    document.body.innerHTML = '<p id="text"></p><div class="injectionDiv"><p id="block"></p></div>';
    const touch = (id: string) => document.getElementById(id)!.dispatchEvent(new Event("pointerdown", { bubbles: true }));
    touch("text");
    expect(closed).toBe(0);
    touch("block");
    expect(closed).toBe(1);
    // The program is the same, and so is what was told of it.
    expect(useTrials.getState().luck?.works).toBe(18);
    document.body.innerHTML = "";
    useStudio.setState({ leader: { blocks: "moved" } });
    expect(closed).toBe(1);
    vi.advanceTimersByTime(1500);
    listeners.onOpen();
    expect(sent.map((each) => each.do)).toEqual(["try", "try"]);
    // What is over stays.
    listeners.onMessage(JSON.stringify({ is: "luck", works: 180, tried: 200, of: 200, failed: [5, 9] }));
    useStudio.setState({ leader: { blocks: "moved again" } });
    expect(closed).toBe(1);
    end();
    vi.useRealTimers();
  });

  it("begin nothing without blocks", () => {
    useStudio.setState({ compiled: { ...(compiled("AAAA") as object), states: 0 } as never });
    const end = new TrialStream().watch();
    playing(true);
    expect(sent).toEqual([]);
    end();
  });

  it("wait for a button in a class, and begin nothing without a goal", () => {
    const stream = new TrialStream();
    useStudio.setState({ capabilities: { classroom: "pupil" } as never });
    const end = stream.watch();
    playing(true);
    useStudio.setState({ mission: null });
    useDraft.setState({ draft: null });
    stream.begin();
    expect(sent).toEqual([]);
    end();
  });

  it("show both runs where they part", () => {
    const { stream, end } = begin();
    stream.compare({ mat: {} as never, seed: 0 }, { mat: {} as never, seed: 1 }, 5000);
    listeners.onMessage(JSON.stringify({ is: "difference", kind: "word", t_ms: 1240, words: [null, "ec800000"], begun: [[], []] }));
    expect(sent.slice(1).map((each) => each.do)).toEqual(["compare", "show"]);
    expect(sent.at(-1)).toEqual({ do: "show", t_ms: 1240 });
    expect(useTrials.getState().shownMs).toBe(1240);
    stream.endComparison();
    expect(useTrials.getState().runs).toBeNull();
    end();
  });
});

it("a difference is told with its car, time and cause", () => {
  const difference = (changes: Partial<Difference>): Difference => ({
    is: "difference",
    kind: "word",
    t_ms: 4234,
    car: 7,
    missed: 1,
    late_ms: null,
    words: ["ec800000", null],
    cause: { en: "car 3 sent at the same time as car 5", zh: "" },
    exact_ms: 60,
    exact_car: 2,
    begun: [[], []],
    ...changes,
  });
  const text = (changes: Partial<Difference>) => differenceText(difference(changes), ["This run", "Luck 5"]);
  expect(text({})).toMatch(/^Car 7 missed '.*' at 4\.2 s \(Luck 5\), because car 3 sent at the same time as car 5\.$/);
  expect(text({ missed: null, words: ["ec800000", "f4800000"], cause: null })).toMatch(/^Car 7 begins something else at 4\.2 s\. This run: '.*'\. Luck 5: '.*'\.$/);
  expect(text({ late_ms: 1100 })).toMatch(/^Car 7 begins '.*' at 4\.2 s, but 1\.1 s later in one run \(Luck 5\), because/);
  expect(text({ kind: "place" })).toBe("All words are the same. From 4.2 s on car 7 stands elsewhere.");
  expect(text({ kind: "none" })).toBe("No car does anything else in these two runs.");
});
