import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import cases from "../../../tests/drive/deadman_cases.json";
import { PlayedStream } from "../api/testStream";
import { PERIOD_MS } from "../generated/driving";
import { useSettings } from "../state/settings";
import { AT_REST, type Axes, DeadmanSwitch, HeldInputs, RemoteLink, socketAddress, stampAt, type Switches, useRemote, userOf } from "./link";

const LISTED = ["0", "1", "2"].map((car) => ({ car, leads: car === "0", sees: true, name: null }));

let nowMs = 0;

/** The link's newest stream, on which the server says hello. */
function answered(): PlayedStream {
  const server = PlayedStream.all.at(-1)!;
  server.open();
  server.say({ is: "hello", cars: LISTED });
  return server;
}

function opened(firstCar: string | null = null): { link: RemoteLink; server: PlayedStream } {
  const link = new RemoteLink((page) => new PlayedStream(page), () => nowMs);
  link.open(firstCar);
  return { link, server: answered() };
}

beforeEach(() => {
  PlayedStream.all = [];
  nowMs = 0;
  vi.useFakeTimers();
  useRemote.setState(useRemote.getInitialState(), true);
});
afterEach(() => vi.useRealTimers());

describe("a link", () => {
  it("joins the first car, or the one that is asked for", () => {
    expect(opened().server.messages).toEqual([{ do: "join", car: "0" }]);
    useRemote.setState(useRemote.getInitialState(), true);
    expect(opened("2").server.messages).toEqual([{ do: "join", car: "2" }]);
  });

  it("drives all cars that it joined with one message of two axes", () => {
    const { link, server } = opened();
    link.join("1");
    link.drive({ throttle: 0.5, steering: -1 });
    expect(server.messages.at(-1)).toEqual({ do: "drive", cars: ["0", "1"], throttle: 0.5, steering: -1, number: 1, stamp: 1 });
    link.leave("0");
    link.stopAll();
    expect(server.messages.at(-1)).toEqual({ do: "stop", cars: ["1"] });
  });

  it("measures the time from a stick to its answer", () => {
    const { link, server } = opened();
    link.drive({ throttle: 1, steering: 0 });
    nowMs = 37;
    server.say({ is: "received", number: 1 });
    expect(useRemote.getState().roundTripMs).toBe(37);
    server.say({ is: "received", number: 999 });
    expect(useRemote.getState().roundTripMs).toBe(37);
  });

  it("answers the server's clock, so that its positions count again after a rest", () => {
    const { link, server } = opened();
    link.drive({ throttle: 0, steering: 0 });
    nowMs = 4000;
    server.say({ is: "telemetry", cars: {}, clock: 1234 });
    expect(server.messages.at(-1)).toEqual({ do: "sync", clock: 1234, number: 1, stamp: 1001 });
  });

  it("comes back by itself, joins the same cars, and shows nothing old meanwhile", () => {
    const { link, server } = opened();
    link.join("2");
    server.say({ is: "telemetry", cars: { 0: { state: "moving" } }, clock: null });
    server.end();
    expect(useRemote.getState()).toMatchObject({ open: false, telemetry: {} });
    link.drive({ throttle: 1, steering: 0 });
    vi.advanceTimersByTime(1000);
    expect(PlayedStream.all).toHaveLength(2);
    expect(answered().messages).toEqual([
      { do: "join", car: "0" },
      { do: "join", car: "2" },
    ]);
    expect(useRemote.getState()).toMatchObject({ open: true, joined: ["0", "2"] });
  });

  it("leaves cars that are there no longer", () => {
    const { link, server } = opened();
    link.join("2");
    server.say({ is: "hello", cars: LISTED.slice(0, 2) });
    expect(useRemote.getState().joined).toEqual(["0"]);
  });
});

const AHEAD = { throttle: 1, steering: 0 };
const LEFT = { throttle: 0.5, steering: -1 };

type Pair = [throttle: number, steering: number] | null;
type Step = [atMs: number, does: "" | "command" | "release" | "order" | "lose", axes: Pair, sends: Pair];

const toAxes = ([throttle, steering]: NonNullable<Pair>): Axes => ({ throttle, steering });

describe("a dead-man switch", () => {
  it.each(cases.persons)("does what Python's does: $name", ({ steps }) => {
    const deadman = new DeadmanSwitch();
    for (const [atMs, does, axes, sends] of steps as Step[]) {
      if (does === "command") deadman.command(toAxes(axes!), atMs);
      else if (does === "release") deadman.release(atMs);
      else if (does !== "") deadman[does]();
      expect(deadman.next(atMs), `at ${atMs} ms`).toEqual(sends && toAxes(sends));
    }
  });

  it.each(cases.stamps)("stamps %i ms as Python does", (nowMs, stamp) => expect(stampAt(nowMs)).toBe(stamp));
});

function held() {
  const sent: Axes[] = [];
  let nowMs = 0;
  const inputs = new HeldInputs((axes) => sent.push(axes), () => nowMs);
  const pass = (periods: number) => {
    const before = sent.length;
    for (let k = 0; k < periods; k++) {
      nowMs += PERIOD_MS;
      inputs.tick();
    }
    return sent.slice(before);
  };
  return { inputs, sent, pass };
}

describe("what is held", () => {
  it("is sent at once at rest, then for as long as it is held, and never when nothing is", () => {
    const { inputs, sent, pass } = held();
    expect(pass(20)).toEqual([]);
    inputs.hold("stick", AHEAD);
    expect(sent).toEqual([AT_REST]);
    expect(pass(10)).toEqual(Array<Axes>(10).fill(AHEAD));
  });

  it("is what the input holds that was taken last, and the other's again after its release", () => {
    const { inputs, pass } = held();
    inputs.hold("keys", AHEAD);
    pass(4);
    inputs.hold("stick", LEFT);
    expect(pass(1)).toEqual([LEFT]);
    inputs.hold("keys", AHEAD);
    expect(pass(1)).toEqual([LEFT]);
    inputs.release("stick");
    expect(pass(1)).toEqual([AHEAD]);
  });

  it("is released, whatever it is, when the page is hidden", () => {
    const { inputs, sent, pass } = held();
    inputs.hold("keys", AHEAD);
    inputs.hold("gamepad", LEFT);
    pass(3);
    inputs.releaseAll();
    expect(sent.at(-1)).toEqual(AT_REST);
    expect(pass(1)).toEqual([AT_REST]);
  });

  it.each(["lose", "order"] as const)("does nothing more behind %s until it is released", (what) => {
    const { inputs, pass, sent } = held();
    inputs.hold("stick", AHEAD);
    pass(4);
    inputs.deadman[what]();
    inputs.hold("stick", AHEAD);
    expect(pass(5)).toEqual([]);
    inputs.release("stick");
    inputs.hold("stick", AHEAD);
    expect(sent.slice(-2)).toEqual([AT_REST, AT_REST]);
    expect(pass(3)).toEqual([AHEAD, AHEAD, AHEAD]);
  });

  it("switches a horn on while it is pressed, off at once when it is lifted, and a light until it is switched again", () => {
    const switched: Switches[] = [];
    let nowMs = 0;
    const inputs = new HeldInputs((axes, switches) => switched.push({ ...switches, moves: axes.throttle }), () => nowMs);
    inputs.press("horn");
    expect(switched).toEqual([{ horn: 1, moves: 0 }]);
    nowMs = 50;
    inputs.lift("horn");
    expect(switched.at(-1)).toEqual({ horn: 0, moves: 0 });
    nowMs = 100;
    inputs.set("head_light", 1);
    expect(switched.at(-1)).toEqual({ head_light: 1, horn: 0, moves: 0 });
    nowMs = 600;
    inputs.tick();
    inputs.press("horn");
    inputs.releaseAll();
    expect(switched.at(-1)).toEqual({ horn: 0, moves: 0 });
    inputs.press("horn");
    inputs.deadman.order();
    const before = switched.length;
    inputs.releaseAll();
    expect(switched.slice(before).filter(({ horn }) => horn === 1)).toEqual([]);
  });

  it("goes no faster than the limit", () => {
    const { inputs, pass } = held();
    inputs.limit = 0.5;
    inputs.hold("stick", { throttle: -1, steering: 1 });
    expect(pass(3).at(-1)).toEqual({ throttle: -0.5, steering: 1 });
  });
});

describe("the user's name", () => {
  it("is sent where there is one, whatever it contains, and read from a driver's", () => {
    for (const userName of [null, "", "Lin", "小林 & co?name=eve#"]) {
      useSettings.setState({ userName });
      expect(new URL(socketAddress()).searchParams.get("name")).toBe(userName === "" ? null : userName);
    }
    expect(userOf("Lin · 192.168.1.7:53124")).toBe("Lin");
    expect([userOf("192.168.1.7:53124"), userOf("lin:53124"), userOf(null)]).toEqual([null, null, null]);
  });

  it("connects again under a new name and joins the same cars", () => {
    const { link, server } = opened("1");
    link.reconnect();
    expect(useRemote.getState().open).toBe(false);
    vi.advanceTimersByTime(625);
    expect(server.isOpen).toBe(false);
    expect(answered().messages).toEqual([{ do: "join", car: "1" }]);
  });
});
