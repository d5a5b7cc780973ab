/**
 * When a page sends its stick, as motorcade.drive.deadman and stamps say. Written by scripts/generate.py; don't edit.
 */

/**
 * - idle: nothing is sent
 * - arming: speed 0 is sent, so that the car is armed before it moves
 * - driving: the command is sent
 * - resting: speed 0 is sent again and again, in case a message is lost
 * - locked: nothing is sent until speed 0 or nothing is commanded
 */
export type DeadmanState = "idle" | "arming" | "driving" | "resting" | "locked";

/**
 * - speed: a speed is commanded
 * - still: speed 0 is commanded
 * - nothing: the command is withdrawn, or was not renewed for fresh_ms
 * - lost: the car may have stopped by itself while a person commands a speed
 * - again: the car may have stopped by itself, and is armed anew
 * - order: the caller stops the car, gives it back or lets its program drive
 * - over: the state has lasted for its time in LASTS_MS
 */
export type DeadmanEvent = "speed" | "still" | "nothing" | "lost" | "again" | "order" | "over";

/** The next state for a state and an event; an event that isn't there changes nothing. */
export const NEXT: Record<DeadmanState, Partial<Record<DeadmanEvent, DeadmanState>>> = {
  "idle": {"speed": "arming", "still": "arming"},
  "arming": {"nothing": "resting", "lost": "locked", "again": "arming", "order": "idle", "over": "driving"},
  "driving": {"nothing": "resting", "lost": "locked", "again": "arming", "order": "idle"},
  "resting": {"speed": "arming", "still": "arming", "lost": "idle", "again": "idle", "order": "idle", "over": "idle"},
  "locked": {"still": "arming", "nothing": "resting"},
};

/** After how long a state gets the event `over`. */
export const LASTS_MS: Partial<Record<DeadmanState, number>> = {"arming": 45, "resting": 200};

/** How often a command is sent. */
export const PERIOD_MS = 50;

/** How long a command counts. */
export const FRESH_MS = 300;

/** A stamp counts steps of so many milliseconds, and comes round after so many of them. */
export const STAMP_STEP_MS = 4;
export const STAMP_STEPS = 2047;

/** What a driver switches beside the wheels, with its key; one that is held goes off when released. */
export interface Switch { name: string; held: boolean; key: string }

export const SWITCHES: readonly Switch[] = [
  {"name": "head_light", "held": false, "key": "l"},
  {"name": "horn", "held": true, "key": "h"},
];
