/** A world of cars in play: the messages to it, its answers, and its pictures. */

import type { WorldAnswer, WorldMessage } from "../generated/messages";
import { columnBytes, type Columns, columnsOf, EVENT_COLUMNS, EventColumn, HEADER, HEADER_BYTES, KINDS, LOSS_REASONS } from "../generated/world";

export { EVENT_COLUMNS, EventColumn, Flag, KINDS, LATELY_S, LOSS_REASONS, MOST_EVENTS, NO_INDEX, NO_LED } from "../generated/world";

export interface Pose {
  x_m: number;
  y_m: number;
  heading_deg: number;
}

export type Command = WorldMessage;
export type Answer = WorldAnswer;
export type { CarDetails, Goals, WorldHello, State as WorldState, Refused as WorldProblem } from "../generated/messages";

/** What all cars show at a moment, and what happened since the picture before. */
export interface Picture extends Columns {
  frame: number;
  tMs: number;
  /** Whether it is a stored moment instead of the present. */
  past: boolean;
  /** Whether it doesn't continue the picture before: the first after a set or a seek. */
  fresh: boolean;
  cars: number;
  /** How many frames were lost in the LATELY_S before. */
  lost: number;
  /** Rows of EVENT_COLUMNS numbers; `EventColumn` says which. */
  events: Uint32Array;
}

export type EventKind = (typeof KINDS)[number];
export type LossReason = (typeof LOSS_REASONS)[number];

/** What happened to a car. */
export interface CarEvent {
  tMs: number;
  car: number;
  kind: EventKind;
  why: LossReason;
  word: number;
  other: number;
}

/** The event in a row of events. */
export function eventIn(rows: Uint32Array, row: number): CarEvent {
  const at = row * EVENT_COLUMNS;
  const kind = rows[at + EventColumn.kind]!;
  return {
    tMs: rows[at + EventColumn.tMs]!,
    car: rows[at + EventColumn.car]!,
    kind: KINDS[kind & 255] ?? "state",
    why: LOSS_REASONS[(kind >> 8) & 255] ?? "",
    word: rows[at + EventColumn.word]!,
    other: rows[at + EventColumn.other]!,
  };
}

/** What happened since the picture before, the oldest first. */
export function* eventsOf({ events }: Picture): Generator<CarEvent> {
  for (let row = 0; row < events.length / EVENT_COLUMNS; row++) yield eventIn(events, row);
}

/** The kind of a picture, and the flags of one of the past, and of one that doesn't continue the one before. */
const PICTURE = 1;
const PAST = 1;
const FRESH = 2;

/** Null for bytes that are no picture: of another kind, or cut off. */
export function decodePicture(bytes: ArrayBuffer): Picture | null {
  if (bytes.byteLength < HEADER_BYTES) return null;
  const head = new DataView(bytes);
  const number = (at: number) => head.getUint32(at, true);
  const [cars, events] = [number(HEADER.cars), number(HEADER.events)];
  const eventsAt = HEADER_BYTES + columnBytes(cars);
  if (head.getUint8(HEADER.kind) !== PICTURE || bytes.byteLength !== eventsAt + events * EVENT_COLUMNS * 4) return null;
  const flags = head.getUint8(HEADER.flags);
  return {
    frame: number(HEADER.number),
    tMs: number(HEADER.t_ms),
    past: (flags & PAST) !== 0,
    fresh: (flags & FRESH) !== 0,
    cars,
    lost: number(HEADER.lost),
    ...columnsOf(bytes, HEADER_BYTES, cars),
    events: new Uint32Array(bytes, eventsAt, events * EVENT_COLUMNS),
  };
}

/** Where a car is in a picture; null where there is no such car. */
export function poseIn(picture: Picture, car: number): Pose | null {
  if (car >= picture.cars) return null;
  const heading_deg = Math.round((picture.heading[car]! * 180) / Math.PI);
  return { x_m: picture.x[car]!, y_m: picture.y[car]!, heading_deg };
}
