/** The events of all cars: a ring of the newest, and how many of them fit into a lane of so many pixels. */

import { type CarEvent, EVENT_COLUMNS, EventColumn, eventIn, type EventKind, MOST_EVENTS, type Picture } from "../api/world";
import { FLOW_OPS } from "../generated/steps";
import { valueOf } from "../words/values";

const NONE = -1;
/** 8 MiB of rows, and about ten minutes of a class's twenty cars. */
const MOST_STORED = 1 << 18;

export class EventStore {
  private readonly rows: Uint32Array;
  private readonly before: Float64Array;
  private last: Float64Array = new Float64Array();
  private taken = 0;
  /** The number of changes so far, so that drawing can skip a state that was drawn before. */
  version = 0;
  /** All events from this time on are stored; some before may be missing. */
  knownFromMs = 0;
  /** Counts the runs: the stored events are those of the last one. */
  runs = 0;

  constructor(private readonly most = MOST_STORED) {
    this.rows = new Uint32Array(most * EVENT_COLUMNS);
    this.before = new Float64Array(most);
  }

  get count(): number {
    return Math.min(this.taken, this.most);
  }

  clear(cars: number): void {
    this.last = new Float64Array(cars).fill(NONE);
    this.taken = this.knownFromMs = 0;
    this.runs += 1;
    this.version += 1;
  }

  /** Whether the events of the shown past are stored. */
  take(picture: Picture): void {
    if (picture.past) return;
    if (picture.fresh || picture.cars !== this.last.length) this.clear(picture.cars);
    const { events } = picture;
    if (events.length >= MOST_EVENTS * EVENT_COLUMNS) this.knownFromMs = events[EventColumn.tMs]! + 1;
    for (let at = 0; at < events.length; at += EVENT_COLUMNS) {
      const car = events[at + EventColumn.car]!;
      const place = this.taken % this.most;
      if (this.taken >= this.most) this.knownFromMs = Math.max(this.knownFromMs, this.row(place).tMs + 1);
      this.rows.set(events.subarray(at, at + EVENT_COLUMNS), place * EVENT_COLUMNS);
      this.before[place] = this.last[car] ?? NONE;
      this.last[car] = this.taken;
      this.taken += 1;
    }
    if (events.length) this.version += 1;
  }

  /** A car's stored events, newest first. */
  *of(car: number): Generator<CarEvent> {
    const oldest = this.taken - this.count;
    for (let at = this.last[car] ?? NONE; at >= oldest && at !== NONE; at = this.before[at % this.most]!) {
      yield this.row(at % this.most);
    }
  }

  /** No event before this time is stored, though there were some; 0 where all are. */
  get forgottenUntilMs(): number {
    return this.knownFromMs > 0 && this.taken ? this.row((this.taken - this.count) % this.most).tMs : 0;
  }

  /** The rows of all stored events, oldest first, as bytes. */
  bytes(): Uint8Array {
    const begin = this.taken > this.most ? (this.taken % this.most) * EVENT_COLUMNS : 0;
    const rows = this.rows.subarray(0, this.count * EVENT_COLUMNS);
    const whole = new Uint32Array(rows.length);
    whole.set(rows.subarray(begin));
    whole.set(rows.subarray(0, begin), rows.length - begin);
    return new Uint8Array(whole.buffer);
  }

  private row(place: number): CarEvent {
    return eventIn(this.rows, place);
  }
}

export interface Window {
  beginMs: number;
  endMs: number;
}

/** The distance of the shown moment from the right edge, so that the events after it are visible. */
const LEAD_SHARE = 0.08;

/** The window that ends a little after the present; or, in the past, the one that the past moment was in. */
export function windowAt(before: Window | null, spanMs: number, tMs: number, past: boolean): Window {
  const fits = before !== null && before.endMs - before.beginMs === spanMs;
  if (fits && past && tMs >= before.beginMs && tMs <= before.endMs) return before;
  const endMs = past ? tMs + spanMs / 2 : Math.max(spanMs, tMs + spanMs * LEAD_SHARE);
  const beginMs = Math.max(0, endMs - spanMs);
  return { beginMs, endMs: beginMs + spanMs };
}

interface BlockSpan {
  beginMs: number;
  endMs: number;
  word: number;
}

export const Mark = { frame: 1, heard: 2, lost: 4 } as const;

/** What a leader decided: a jump was taken or not, a condition ended a state, something was told. */
type Decision = "taken" | "passed" | "ended" | "told";
/** The index of the word behind a flow word, in an event's `other`. */
const NEXT_WORD = 256;

/** What an event says that a leader decided; null where it decided nothing. */
export function decisionOf({ kind, word, other }: CarEvent): Decision | null {
  const flow = { hex: word.toString(16).padStart(8, "0"), part: "leader", block: null } as const;
  if (kind === "over") return valueOf(flow, "until") ? "ended" : null;
  if (kind !== "flow") return null;
  const op = FLOW_OPS[valueOf(flow, "op")];
  if (op === "tell") return "told";
  if ((op !== "jump" && op !== "call") || valueOf(flow, "condition") === 0) return null;
  return Math.floor(other / NEXT_WORD) === valueOf(flow, "target") ? "taken" : "passed";
}

export interface Lane {
  spans: BlockSpan[];
  /** What happened in each pixel, as a sum of marks: thousands of frames become one column. */
  marks: Uint8Array;
  decisions: { tMs: number; what: Decision }[];
}

/** `events` come newest first; a word that isn't over lasts until now. */
export function packLane(events: Iterable<CarEvent>, window: Window, nowMs: number, pixels: number): Lane {
  const lane: Lane = { spans: [], marks: new Uint8Array(pixels), decisions: [] };
  let endMs = nowMs;
  for (const event of events) {
    const { kind, tMs, word } = event;
    const what = tMs >= window.beginMs && tMs < window.endMs ? decisionOf(event) : null;
    if (what) lane.decisions.push({ tMs, what });
    if (kind === "over") endMs = tMs;
    if (kind === "state" || kind === "start") {
      if (tMs < window.endMs && endMs > window.beginMs) lane.spans.push({ beginMs: tMs, endMs, word });
      endMs = tMs;
      if (tMs <= window.beginMs) break;
    }
    if (kind in Mark && tMs >= window.beginMs && tMs < window.endMs) {
      const column = Math.floor(((tMs - window.beginMs) / (window.endMs - window.beginMs)) * pixels);
      lane.marks[column]! |= Mark[kind as keyof typeof Mark];
    }
  }
  lane.spans.reverse();
  return lane;
}

export type Jump = "word" | "decision" | "heard" | "lost";
const JUMPS: Record<Exclude<Jump, "decision">, readonly EventKind[]> = { word: ["state", "start"], heard: ["heard"], lost: ["lost"] };
const isOf = (event: CarEvent, jump: Jump) => (jump === "decision" ? decisionOf(event) !== null : JUMPS[jump].includes(event.kind));

/** The next or the last event of a kind, seen from a moment. */
export function jumpTo(events: Iterable<CarEvent>, kind: Jump, fromMs: number, forward: boolean): CarEvent | null {
  let next: CarEvent | null = null;
  for (const event of events) {
    if (!isOf(event, kind)) continue;
    if (forward && event.tMs > fromMs) next = event;
    if (!forward && event.tMs < fromMs) return event;
    if (forward && event.tMs <= fromMs) break;
  }
  return next;
}

/** Possible distances between the axis's labels; the smallest at which they don't overlap is used. */
const STEPS_MS = [100, 200, 500, 1000, 2000, 5000, 10_000, 20_000, 30_000, 60_000, 120_000, 300_000, 600_000];

export function ticksOf(window: Window, pixels: number, leastPx = 64): { atMs: number[]; stepMs: number } {
  const least = ((window.endMs - window.beginMs) / Math.max(1, pixels)) * leastPx;
  const stepMs = STEPS_MS.find((step) => step >= least) ?? STEPS_MS.at(-1)!;
  const atMs: number[] = [];
  for (let at = Math.ceil(window.beginMs / stepMs) * stepMs; at <= window.endMs; at += stepMs) atMs.push(at);
  return { atMs, stepMs };
}

/** A time such as 1:05.0, or 1:05 without tenths. */
export function clock(ms: number, tenths = true): string {
  const seconds = Math.floor(ms / 1000);
  const shown = `${Math.floor(seconds / 60)}:${String(seconds % 60).padStart(2, "0")}`;
  return tenths ? `${shown}.${Math.floor((ms % 1000) / 100)}` : shown;
}
