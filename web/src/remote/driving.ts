/** This page's connection and its dead-man switch, and the keys and gamepads that hold it. */

import { asksToStop, DeadmanSwitch, gamepadAxes, isDrivingKey, keyAxes, PERIOD_MS } from "./input";
import { Link } from "./link";

/** The address of a path of the server's, for a car, in the studio's world that the page's own address names. */
export function address(path: string, car?: string): string {
  const session = new URLSearchParams(location.search).get("session");
  const query = new URLSearchParams({ ...(session && { session }), ...(car && { car }) });
  return query.size > 0 ? `${path}?${query}` : path;
}

/** The share of the highest speed that a page begins with. */
export const FIRST_LIMIT = 0.6;

const now = () => performance.now();

export const link = new Link(() => new WebSocket(`${location.origin.replace(/^http/, "ws")}${address("/drive/ws")}`), now);
export const deadman = new DeadmanSwitch((axes) => link.drive(axes), now);

const keys = new Set<string>();

function holdKeys(): void {
  const axes = keyAxes(keys);
  if (axes) deadman.hold("keys", axes);
  else deadman.release("keys");
}

/** Whether a key belongs to the focused field. On a button the space bar stops the cars: Enter presses the button. */
const isForField = ({ target }: KeyboardEvent) => target instanceof Element && target.matches("input, select, summary");

function keyDown(event: KeyboardEvent): void {
  if (event.ctrlKey || event.metaKey || event.altKey || isForField(event)) return;
  if (event.code === "Space") {
    event.preventDefault();
    deadman.releaseAll();
    link.stopAll();
  } else if (isDrivingKey(event.code)) {
    event.preventDefault();
    keys.add(event.code);
    holdKeys();
  }
}

function keyUp(event: KeyboardEvent): void {
  if (keys.delete(event.code)) holdKeys();
  // Some browsers press a button when the space bar comes up.
  if (event.code === "Space" && !isForField(event)) event.preventDefault();
}

let stopWasPressed = false;

function pollGamepad(): void {
  // Browsers give gamepads to secure pages alone: those of this computer, and by HTTPS.
  const pads = "getGamepads" in navigator ? navigator.getGamepads() : [];
  const pad = pads.find((each) => each?.connected);
  const axes = pad && gamepadAxes(pad);
  if (axes) deadman.hold("gamepad", axes);
  else deadman.release("gamepad");
  const stop = pad ? asksToStop(pad) : false;
  if (stop && !stopWasPressed) link.stopAll();
  stopWasPressed = stop;
}

function releaseAll(): void {
  keys.clear();
  deadman.releaseAll();
}

/** Connect and follow keys and gamepads. A page that is hidden or without the focus holds nothing. To be called once. */
export function startDriving(): void {
  deadman.limit = FIRST_LIMIT;
  link.open(new URLSearchParams(location.search).get("car"));
  window.addEventListener("keydown", keyDown);
  window.addEventListener("keyup", keyUp);
  window.addEventListener("blur", releaseAll);
  window.addEventListener("pagehide", releaseAll);
  document.addEventListener("visibilitychange", () => document.hidden && releaseAll());
  setInterval(() => {
    if (document.hidden) return;
    pollGamepad();
    deadman.tick();
  }, PERIOD_MS);
}
