import { describe, expect, it } from "vitest";
import { asksToStop, AT_REST, type Axes, DeadmanSwitch, fingerAxes, gamepadAxes, isDrivingKey, keyAxes, PERIOD_MS } from "./input";

const AHEAD = { throttle: 1, steering: 0 };
const LEFT = { throttle: 0.5, steering: -1 };

function held() {
  const sent: Axes[] = [];
  let nowMs = 0;
  const deadman = new DeadmanSwitch((axes) => sent.push(axes), () => nowMs);
  const pass = (periods: number) => {
    const before = sent.length;
    for (let k = 0; k < periods; k++) {
      nowMs += PERIOD_MS;
      deadman.tick();
    }
    return sent.slice(before);
  };
  return { deadman, sent, pass };
}

describe("a dead-man switch", () => {
  it("sends a stick at rest first, and then the stick for as long as it is held", () => {
    const { deadman, sent, pass } = held();
    deadman.hold("stick", AHEAD);
    expect(sent).toEqual([AT_REST]);
    expect(pass(5)).toEqual([AT_REST, AHEAD, AHEAD, AHEAD, AHEAD]);
  });

  it("stops at once when the stick is released, repeats that some times, and then sends nothing", () => {
    const { deadman, sent, pass } = held();
    deadman.hold("stick", AHEAD);
    pass(4);
    deadman.release("stick");
    expect(sent.at(-1)).toEqual(AT_REST);
    const after = pass(10);
    expect(after.length).toBeGreaterThan(1);
    expect(after.every((axes) => axes.throttle === 0)).toBe(true);
    expect(pass(10)).toEqual([]);
  });

  it("sends nothing while nothing is held", () => expect(held().pass(20)).toEqual([]));

  it("follows the input taken last, and the other one again after its release", () => {
    const { deadman, pass } = held();
    deadman.hold("keys", AHEAD);
    pass(4);
    deadman.hold("stick", LEFT);
    expect(pass(1)).toEqual([LEFT]);
    deadman.hold("keys", AHEAD);
    expect(pass(1)).toEqual([LEFT]);
    deadman.release("stick");
    expect(pass(1)).toEqual([AHEAD]);
  });

  it("stops whatever is held when the page is hidden", () => {
    const { deadman, sent, pass } = held();
    deadman.hold("keys", AHEAD);
    deadman.hold("gamepad", LEFT);
    pass(3);
    deadman.releaseAll();
    expect(sent.at(-1)).toEqual(AT_REST);
    expect(pass(1)).toEqual([AT_REST]);
  });

  it("goes no faster than the limit", () => {
    const { deadman, pass } = held();
    deadman.limit = 0.5;
    deadman.hold("stick", { throttle: -1, steering: 1 });
    expect(pass(3).at(-1)).toEqual({ throttle: -0.5, steering: 1 });
  });
});

const button = (value: number) => ({ value, pressed: value > 0.5 });
const pad = (axes: number[], pressed: Record<number, number> = {}) => ({
  axes,
  buttons: Array.from({ length: 16 }, (_, k) => button(pressed[k] ?? 0)),
});

describe("a finger", () => {
  it("pushes forward by going up, and no farther than the pad reaches", () => {
    expect(fingerAxes(0, -0.5)).toEqual({ throttle: 0.5, steering: 0 });
    expect(fingerAxes(3, 2)).toEqual({ throttle: -1, steering: 1 });
  });
});

describe("keys", () => {
  it("drive by arrows and by letters, two at a time", () => {
    expect(keyAxes(new Set(["ArrowUp"]))).toEqual({ throttle: 1, steering: 0 });
    expect(keyAxes(new Set(["KeyS", "KeyA"]))).toEqual({ throttle: -1, steering: -1 });
    expect(keyAxes(new Set(["ArrowUp", "KeyW", "ArrowRight"]))).toEqual({ throttle: 1, steering: 1 });
  });

  it("that contradict each other stop the car", () =>
    expect(keyAxes(new Set(["ArrowUp", "ArrowDown"]))).toEqual({ throttle: 0, steering: 0 }));

  it("give nothing when none is held", () => {
    expect(keyAxes(new Set())).toBeNull();
    expect(keyAxes(new Set(["KeyQ"]))).toBeNull();
    expect(isDrivingKey("KeyQ")).toBe(false);
  });
});

describe("a gamepad", () => {
  it("at rest gives nothing, even with a worn stick", () => expect(gamepadAxes(pad([0.05, -0.1, 0, 0]))).toBeNull());

  it("drives by its left stick, smoothly from the edge of its dead zone on", () => {
    expect(gamepadAxes(pad([0, -1]))).toEqual({ throttle: 1, steering: 0 });
    const little = gamepadAxes(pad([-0.13, 0]))!;
    expect(little.steering).toBeLessThan(0);
    expect(little.steering).toBeGreaterThan(-0.05);
  });

  it("drives by its triggers", () => {
    expect(gamepadAxes(pad([1, 0], { 7: 1 }))).toEqual({ throttle: 1, steering: 1 });
    expect(gamepadAxes(pad([0, 0], { 6: 1 }))).toEqual({ throttle: -1, steering: 0 });
  });

  it("stops all by its second button", () => {
    expect(asksToStop(pad([], { 1: 1 }))).toBe(true);
    expect(asksToStop(pad([], { 0: 1 }))).toBe(false);
  });

  it("without the usual buttons and axes gives nothing", () => {
    expect(gamepadAxes({ axes: [], buttons: [] })).toBeNull();
    expect(asksToStop({ axes: [], buttons: [] })).toBe(false);
  });
});
