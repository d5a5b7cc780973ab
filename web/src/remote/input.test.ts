import { describe, expect, it } from "vitest";
import { asksToStop, fingerAxes, gamepadAxes, isDrivingKey, keyAxes } from "./input";

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
