/** Messages between the remote's page and the server. Written by scripts/generate.py; don't edit. */

import type { Sentence } from "./messages";

/** Connect to a car, to watch or to drive. */
export interface Join { do: "join"; car: string }

/** End the connection to a car. */
export interface Leave { do: "leave"; car: string }

/** The stick's position, for all of these cars. */
export interface Drive {
  do: "drive";
  cars: string[];
  throttle: number;
  steering: number;
  switches?: Record<string, number>;
  number?: number;
  stamp?: number;
}

/** Ask to drive. */
export interface RequestDrive { do: "request"; car: string }

/** Stop driving, or stop waiting to drive. */
export interface Release { do: "release"; car: string }

/** Emergency stop of all of these cars. */
export interface Stop { do: "stop"; cars: string[] }

/** Lift the emergency stop. */
export interface Clear { do: "clear"; car: string }

/** Give the car back to its own program. */
export interface Resume { do: "resume"; car: string }

/** The answer to the clock in `Telemetry`, so that the page's stamps are believed again. */
export interface Sync { do: "sync"; clock: number; number: number; stamp: number }

/** Run the cars' world where it is paused. */
export interface Start { do: "start" }

/** The cars, and the page's name at them; the first answer, and the answer to Start. */
export interface RemoteHello { is: "hello"; cars: ListedCar[]; you: string }

/** A car in a page's list. */
export interface ListedCar { car: string; leads: boolean | null; sees: boolean; name: string | null }

/** The telemetry of each car that the page has joined. */
export interface Telemetry { is: "telemetry"; cars: Record<string, CarTelemetry>; clock: number | null }

/** What a page shows of a car's `motorcade.drive.wire.Telemetry`, and what concerns this page. */
export interface CarTelemetry {
  state: "away" | "disarmed" | "discharged" | "failsafe" | "moving" | "program" | "ready" | "standing" | "stopped";
  speed: number;
  driver: string | null;
  wanted_by: string | null;
  battery_mv: number | null;
  last_fault: string;
  switches: Record<string, number>;
  obstacle_mm: number | null;
  paused: boolean;
  silent_ms: number;
  why: Sentence | null;
  you: { drives: boolean; waits: boolean };
}

/** The number of the newest Drive that the server received; ``stale``: it was sent too long ago and did nothing. */
export interface Received { is: "received"; number: number; stale: boolean }

/** The error of a message that was refused. */
export interface Refused { is: "error"; code: string; details: Record<string, unknown>; sentence: Sentence }

export type RemoteMessage = Join | Leave | Drive | RequestDrive | Release | Stop | Clear | Resume | Sync | Start;

export type RemoteAnswer = RemoteHello | Telemetry | Received | Refused;
