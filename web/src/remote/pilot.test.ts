import { describe, expect, it } from "vitest";
import { PERIOD_MS, Pilot, STILL, type Axes } from "./pilot";

const AHEAD = { throttle: 1, steering: 0 };
const LEFT = { throttle: 0.5, steering: -1 };

function flight() {
  const sent: Axes[] = [];
  let nowMs = 0;
  const pilot = new Pilot((axes) => sent.push(axes), () => nowMs);
  const pass = (periods: number) => {
    const before = sent.length;
    for (let k = 0; k < periods; k++) {
      nowMs += PERIOD_MS;
      pilot.tick();
    }
    return sent.slice(before);
  };
  return { pilot, sent, pass };
}

describe("a pilot", () => {
  it("arms a car that has stopped by itself, and then drives for as long as the stick is held", () => {
    const { pilot, sent, pass } = flight();
    pilot.hold("stick", AHEAD);
    expect(sent).toEqual([STILL]);
    expect(pass(5)).toEqual([STILL, AHEAD, AHEAD, AHEAD, AHEAD]);
  });

  it("stops at once when the stick is let go, says so some times, and is silent then", () => {
    const { pilot, sent, pass } = flight();
    pilot.hold("stick", AHEAD);
    pass(4);
    pilot.letGo("stick");
    expect(sent.at(-1)).toEqual(STILL);
    const after = pass(10);
    expect(after.length).toBeGreaterThan(1);
    expect(after.every((axes) => axes.throttle === 0)).toBe(true);
    expect(pass(10)).toEqual([]);
  });

  it("sends nothing while nothing is held", () => expect(flight().pass(20)).toEqual([]));

  it("lets a second hand take over, and the first go on when the second is gone", () => {
    const { pilot, pass } = flight();
    pilot.hold("keys", AHEAD);
    pass(4);
    pilot.hold("stick", LEFT);
    expect(pass(1)).toEqual([LEFT]);
    pilot.hold("keys", AHEAD);
    expect(pass(1)).toEqual([LEFT]);
    pilot.letGo("stick");
    expect(pass(1)).toEqual([AHEAD]);
  });

  it("stops whatever is held when the page is hidden", () => {
    const { pilot, sent, pass } = flight();
    pilot.hold("keys", AHEAD);
    pilot.hold("gamepad", LEFT);
    pass(3);
    pilot.letGoOfAll();
    expect(sent.at(-1)).toEqual(STILL);
    expect(pass(1)).toEqual([STILL]);
  });

  it("goes no faster than the limit", () => {
    const { pilot, pass } = flight();
    pilot.limit = 0.5;
    pilot.hold("stick", { throttle: -1, steering: 1 });
    expect(pass(3).at(-1)).toEqual({ throttle: -0.5, steering: 1 });
  });
});
