/** This page's one link and one pilot, and when the pilot's hand is off by itself. */

import { asksToStop, gamepadAxes, isDrivingKey, keyAxes } from "./handles";
import { Link } from "./link";
import { PERIOD_MS, Pilot } from "./pilot";

const asked = new URLSearchParams(location.search);
const session = asked.get("session");

/** The address of something about a car. */
export function address(path: string, car?: string): string {
  const query = new URLSearchParams({ ...(session && { session }), ...(car && { car }) });
  return query.size > 0 ? `${path}?${query}` : path;
}

const now = () => performance.now();

export const link = new Link(
  () => new WebSocket(`${location.origin.replace(/^http/, "ws")}${address("/drive/ws")}`),
  now,
  asked.get("car"),
);
export const pilot = new Pilot((axes) => link.drive(axes), now);

const keys = new Set<string>();

function takeKeys(): void {
  const axes = keyAxes(keys);
  if (axes) pilot.hold("keys", axes);
  else pilot.letGo("keys");
}

/** In a field keys are the field's. On a button the space bar stops all the same: Enter presses it. */
const isForTheField = ({ target }: KeyboardEvent) => target instanceof Element && target.matches("input, select, summary");

function keyDown(event: KeyboardEvent): void {
  if (event.ctrlKey || event.metaKey || event.altKey || isForTheField(event)) return;
  if (event.code === "Space") {
    event.preventDefault();
    pilot.letGoOfAll();
    link.stopAll();
  } else if (isDrivingKey(event.code)) {
    event.preventDefault();
    keys.add(event.code);
    takeKeys();
  }
}

function keyUp(event: KeyboardEvent): void {
  if (keys.delete(event.code)) takeKeys();
  // Some browsers press a button when the space bar comes up.
  if (event.code === "Space" && !isForTheField(event)) event.preventDefault();
}

let stopWasPressed = false;

function pollGamepad(): void {
  // Browsers give gamepads to secure pages alone: those of this computer, and by HTTPS.
  const pads = "getGamepads" in navigator ? navigator.getGamepads() : [];
  const pad = pads.find((each) => each?.connected);
  const axes = pad && gamepadAxes(pad);
  if (axes) pilot.hold("gamepad", axes);
  else pilot.letGo("gamepad");
  const stop = pad ? asksToStop(pad) : false;
  if (stop && !stopWasPressed) link.stopAll();
  stopWasPressed = stop;
}

function handOff(): void {
  keys.clear();
  pilot.letGoOfAll();
}

/** Begins to drive. A hidden page, or one in which nobody types, holds nothing. */
export function begin(): void {
  link.begin();
  window.addEventListener("keydown", keyDown);
  window.addEventListener("keyup", keyUp);
  window.addEventListener("blur", handOff);
  window.addEventListener("pagehide", handOff);
  document.addEventListener("visibilitychange", () => document.hidden && handOff());
  setInterval(() => {
    if (document.hidden) return;
    pollGamepad();
    pilot.tick();
  }, PERIOD_MS);
}
