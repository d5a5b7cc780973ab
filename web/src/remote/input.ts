/** The inputs that steer cars: finger, keys and gamepads as axes, null where nothing is held; and who listens to them. */

import { PERIOD_MS, type Switch, SWITCHES } from "../generated/driving";
import { type Axes, FIRST_LIMIT, inputs, link, stopAll, useRemote } from "./link";

const clamp = (value: number) => Math.min(1, Math.max(-1, value));

/** A finger's distance right of and below the pad's middle, 1 being the pad's reach. */
export function fingerAxes(right: number, below: number): Axes {
  return { throttle: clamp(-below), steering: clamp(right) };
}

const THROTTLE: Record<string, number> = { ArrowUp: 1, KeyW: 1, ArrowDown: -1, KeyS: -1 };
const STEERING: Record<string, number> = { ArrowLeft: -1, KeyA: -1, ArrowRight: 1, KeyD: 1 };

export const isDrivingKey = (code: string) => code in THROTTLE || code in STEERING;

export function keyAxes(held: ReadonlySet<string>): Axes | null {
  const codes = [...held].filter(isDrivingKey);
  if (codes.length === 0) return null;
  const sum = (of: Record<string, number>) => clamp(codes.reduce((total, code) => total + (of[code] ?? 0), 0));
  return { throttle: sum(THROTTLE), steering: sum(STEERING) };
}

/** What a worn stick can report at rest. */
const DEAD_ZONE = 0.12;
/** Numbers of the standard layout. */
const STEERING_AXIS = 0;
const THROTTLE_AXIS = 1;
const BACK_TRIGGER = 6;
const AHEAD_TRIGGER = 7;
const STOP_BUTTON = 1;

type Pad = Pick<Gamepad, "axes"> & { readonly buttons: readonly Pick<GamepadButton, "value" | "pressed">[] };

const outsideDeadZone = (value: number) =>
  Math.abs(value) <= DEAD_ZONE ? 0 : clamp((value - Math.sign(value) * DEAD_ZONE) / (1 - DEAD_ZONE));

export const asksToStop = (pad: Pad) => pad.buttons[STOP_BUTTON]?.pressed ?? false;

/** The left stick, or the triggers for speed. */
export function gamepadAxes(pad: Pad): Axes | null {
  const triggers = outsideDeadZone(pad.buttons[AHEAD_TRIGGER]?.value ?? 0) - outsideDeadZone(pad.buttons[BACK_TRIGGER]?.value ?? 0);
  const stick = -outsideDeadZone(pad.axes[THROTTLE_AXIS] ?? 0);
  const throttle = Math.abs(triggers) > Math.abs(stick) ? triggers : stick;
  const steering = outsideDeadZone(pad.axes[STEERING_AXIS] ?? 0);
  return throttle === 0 && steering === 0 ? null : { throttle, steering };
}

const keys = new Set<string>();

function holdKeys(): void {
  const axes = keyAxes(keys);
  if (axes) inputs.hold("keys", axes);
  else inputs.release("keys");
}

/** Whether a key belongs to the focused field. On a button the space bar stops the cars: Enter presses the button. */
const isForField = ({ target }: KeyboardEvent) => target instanceof Element && target.matches("input, select, summary");

function keyDown(event: KeyboardEvent): void {
  if (event.ctrlKey || event.metaKey || event.altKey || isForField(event)) return;
  if (event.code === "Space") {
    event.preventDefault();
    stopAll();
  } else if (isDrivingKey(event.code)) {
    event.preventDefault();
    keys.add(event.code);
    holdKeys();
  } else if (!event.repeat && switchOf(event)) pressSwitch(switchOf(event)!);
}

const switchOf = ({ code }: KeyboardEvent) => SWITCHES.find(({ key }) => code === `Key${key.toUpperCase()}`);

/** Press a switch that is held; turn another one over, as it is in the first car that has it. */
function pressSwitch({ name, held }: Switch): void {
  const { joined, telemetry } = useRemote.getState();
  const isOn = joined.map((car) => telemetry[car]?.switches[name]).find((value) => value !== undefined) === 1;
  if (held) inputs.press(name);
  else inputs.set(name, isOn ? 0 : 1);
}

function keyUp(event: KeyboardEvent): void {
  if (keys.delete(event.code)) holdKeys();
  const released = switchOf(event);
  if (released) inputs.lift(released.name);
  // Some browsers press a button when the space bar comes up.
  if (event.code === "Space" && !isForField(event)) event.preventDefault();
}

let stopWasPressed = false;

function pollGamepad(): void {
  // Browsers give gamepads to secure pages alone: those of this computer, and by HTTPS.
  const pads = "getGamepads" in navigator ? navigator.getGamepads() : [];
  const pad = pads.find((each) => each?.connected);
  const axes = pad && gamepadAxes(pad);
  if (axes) inputs.hold("gamepad", axes);
  else inputs.release("gamepad");
  const stop = pad ? asksToStop(pad) : false;
  if (stop && !stopWasPressed) stopAll();
  stopWasPressed = stop;
}

function releaseAll(): void {
  keys.clear();
  inputs.releaseAll();
}

/** Connect and follow keys and gamepads. A page that is hidden or without the focus holds nothing. To be called once. */
export function startDriving(): void {
  inputs.limit = FIRST_LIMIT;
  link.open(new URLSearchParams(location.search).get("car"));
  useRemote.subscribe(({ open }) => open || inputs.deadman.lose());
  window.addEventListener("keydown", keyDown);
  window.addEventListener("keyup", keyUp);
  window.addEventListener("blur", releaseAll);
  window.addEventListener("pagehide", releaseAll);
  document.addEventListener("visibilitychange", () => document.hidden && releaseAll());
  setInterval(() => {
    if (document.hidden) return;
    pollGamepad();
    inputs.tick();
  }, PERIOD_MS);
}
