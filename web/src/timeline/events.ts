/** What happened to the cars, the newest of it: a ring of rows, each linked to its car's row before. */

import { EVENT_COLUMNS, EventColumn, KINDS, type EventKind, type Picture, type Why, WHYS } from "../api/world";

export interface CarEvent {
  tMs: number;
  car: number;
  kind: EventKind;
  why: Why;
  word: number;
  other: number;
}

const NONE = -1;
/** 8 MiB of rows, and about ten minutes of a class's twenty cars. */
const MOST_EVENTS = 1 << 18;

export class EventStore {
  private readonly rows: Uint32Array;
  private readonly before: Float64Array;
  private last: Float64Array = new Float64Array();
  private taken = 0;
  /** Counts changes, for those who draw. */
  version = 0;

  constructor(private readonly most = MOST_EVENTS) {
    this.rows = new Uint32Array(most * EVENT_COLUMNS);
    this.before = new Float64Array(most);
  }

  get count(): number {
    return Math.min(this.taken, this.most);
  }

  clear(cars: number): void {
    this.last = new Float64Array(cars).fill(NONE);
    this.taken = 0;
    this.version += 1;
  }

  /** The past's events are here already. */
  take(picture: Picture): void {
    if (picture.past) return;
    if (picture.fresh || picture.cars !== this.last.length) this.clear(picture.cars);
    const { events } = picture;
    for (let at = 0; at < events.length; at += EVENT_COLUMNS) {
      const car = events[at + EventColumn.car]!;
      const place = this.taken % this.most;
      this.rows.set(events.subarray(at, at + EVENT_COLUMNS), place * EVENT_COLUMNS);
      this.before[place] = this.last[car] ?? NONE;
      this.last[car] = this.taken;
      this.taken += 1;
    }
    if (events.length) this.version += 1;
  }

  /** A car's events, newest first, for as long as they are kept. */
  *of(car: number): Generator<CarEvent> {
    const oldest = this.taken - this.count;
    for (let at = this.last[car] ?? NONE; at >= oldest && at !== NONE; at = this.before[at % this.most]!) {
      yield this.row(at % this.most);
    }
  }

  /** When the oldest event that is kept happened. */
  get earliestMs(): number {
    return this.taken ? this.row((this.taken - this.count) % this.most).tMs : 0;
  }

  private row(place: number): CarEvent {
    const at = place * EVENT_COLUMNS;
    const kind = this.rows[at + EventColumn.kind]!;
    return {
      tMs: this.rows[at + EventColumn.tMs]!,
      car: this.rows[at + EventColumn.car]!,
      kind: KINDS[kind & 255] ?? "state",
      why: WHYS[(kind >> 8) & 255] ?? "",
      word: this.rows[at + EventColumn.word]!,
      other: this.rows[at + EventColumn.other]!,
    };
  }
}
