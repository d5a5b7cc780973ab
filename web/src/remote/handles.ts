/** What a hand does, as axes: a finger on the pad, keys, a gamepad. Null: nothing is held. */

import type { Axes } from "./pilot";

const between = (value: number) => Math.min(1, Math.max(-1, value));

/** A finger that is so far right of and below the pad's middle, in shares of the pad's reach. */
export function fingerAxes(right: number, below: number): Axes {
  return { throttle: between(-below), steering: between(right) };
}

const THROTTLE: Record<string, number> = { ArrowUp: 1, KeyW: 1, ArrowDown: -1, KeyS: -1 };
const STEERING: Record<string, number> = { ArrowLeft: -1, KeyA: -1, ArrowRight: 1, KeyD: 1 };

export const isDrivingKey = (code: string) => code in THROTTLE || code in STEERING;

export function keyAxes(held: ReadonlySet<string>): Axes | null {
  const codes = [...held].filter(isDrivingKey);
  if (codes.length === 0) return null;
  const sum = (of: Record<string, number>) => between(codes.reduce((total, code) => total + (of[code] ?? 0), 0));
  return { throttle: sum(THROTTLE), steering: sum(STEERING) };
}

/** What a worn stick shows though nobody touches it. */
const DEAD_ZONE = 0.12;
/** Of the standard layout. */
const STEERING_AXIS = 0;
const THROTTLE_AXIS = 1;
const BACK_TRIGGER = 6;
const AHEAD_TRIGGER = 7;
const STOP_BUTTON = 1;

type Pad = Pick<Gamepad, "axes"> & { readonly buttons: readonly Pick<GamepadButton, "value" | "pressed">[] };

const alive = (value: number) =>
  Math.abs(value) <= DEAD_ZONE ? 0 : between((value - Math.sign(value) * DEAD_ZONE) / (1 - DEAD_ZONE));

export const asksToStop = (pad: Pad) => pad.buttons[STOP_BUTTON]?.pressed ?? false;

/** The left stick, or the triggers for speed. */
export function gamepadAxes(pad: Pad): Axes | null {
  const triggers = alive(pad.buttons[AHEAD_TRIGGER]?.value ?? 0) - alive(pad.buttons[BACK_TRIGGER]?.value ?? 0);
  const stick = -alive(pad.axes[THROTTLE_AXIS] ?? 0);
  const throttle = Math.abs(triggers) > Math.abs(stick) ? triggers : stick;
  const steering = alive(pad.axes[STEERING_AXIS] ?? 0);
  return throttle === 0 && steering === 0 ? null : { throttle, steering };
}
