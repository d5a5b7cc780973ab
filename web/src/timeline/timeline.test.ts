import { describe, expect, it } from "vitest";
import { type CarEvent, KINDS, type EventKind } from "../api/world";
import { pictureOf } from "../mat/testPictures";
import { EventStore } from "./events";
import { decisionOf, jumpTo, Mark, packLane, ticksOf, windowAt } from "./events";

type Row = [tMs: number, car: number, kind: EventKind, word?: number];

function taken(store: EventStore, rows: readonly Row[], more: Parameters<typeof pictureOf>[1] = {}): EventStore {
  const events = new Uint32Array(rows.flatMap(([tMs, car, kind, word = 0]) => [tMs, car, KINDS.indexOf(kind), word, 0]));
  store.take(pictureOf([{}, {}], { ...more, events }));
  return store;
}

const times = (events: Iterable<CarEvent>) => Array.from(events, ({ tMs }) => tMs);

describe("the event store", () => {
  it("gives each car's events, newest first", () => {
    const store = taken(new EventStore(), [
      [1, 0, "heard"],
      [2, 1, "lost"],
      [3, 0, "start"],
    ]);
    expect(times(store.of(0))).toEqual([3, 1]);
    expect([...store.of(1)][0]).toMatchObject({ tMs: 2, kind: "lost", why: "" });
    expect(times(store.of(7))).toEqual([]);
  });

  it("is bounded, and forgets the oldest first", () => {
    const store = new EventStore(4);
    for (let t = 0; t < 10; t++) taken(store, [[t, t % 2, "heard"]]);
    expect(store.count).toBe(4);
    expect(store.forgottenUntilMs).toBe(6);
    expect(times(store.of(0))).toEqual([8, 6]);
    expect(times(store.of(1))).toEqual([9, 7]);
  });

  it("begins anew with the world, and learns nothing from the past", () => {
    const store = taken(new EventStore(), [[5, 0, "heard"]]);
    expect(store.forgottenUntilMs).toBe(0);
    expect(times(taken(store, [[1, 0, "heard"]], { past: true }).of(0))).toEqual([5]);
    expect(times(taken(store, [[1, 0, "heard"]], { fresh: true }).of(0))).toEqual([1]);
  });
});

const DAY: Row[] = [
  [0, 0, "start", 1],
  [1000, 0, "over", 1],
  [1500, 0, "heard", 2],
  [1500, 0, "start", 2],
  [1501, 0, "lost", 2],
  [3000, 0, "start", 3],
];

describe("a lane", () => {
  const events = () => taken(new EventStore(), DAY).of(0);

  it("shows each word from its beginning until it is over, replaced, or now", () => {
    expect(packLane(events(), { beginMs: 0, endMs: 5000 }, 4000, 100).spans).toEqual([
      { beginMs: 0, endMs: 1000, word: 1 },
      { beginMs: 1500, endMs: 3000, word: 2 },
      { beginMs: 3000, endMs: 4000, word: 3 },
    ]);
  });

  it("shows what reaches into its window, and nothing besides", () => {
    const { spans, marks } = packLane(events(), { beginMs: 2000, endMs: 2500 }, 4000, 10);
    expect(spans).toEqual([{ beginMs: 1500, endMs: 3000, word: 2 }]);
    expect([...marks]).toEqual(Array(10).fill(0));
  });

  it("sums what happens in one pixel", () => {
    const { marks } = packLane(events(), { beginMs: 0, endMs: 4000 }, 4000, 40);
    expect(marks[15]).toBe(Mark.heard | Mark.lost);
    expect(marks.filter((each) => each !== 0)).toHaveLength(1);
  });

  it.each([
    ["word", 1200, true, 1500],
    ["word", 1200, false, 0],
    ["lost", 0, true, 1501],
    ["heard", 1500, true, null],
    ["heard", 1500, false, null],
  ] as const)("a jump to a %s from %i ms (forward: %s) leads to %s", (kind, from, forward, expected) => {
    expect(jumpTo(events(), kind, from, forward)?.tMs ?? null).toBe(expected);
  });
});

/** If nobody is near, go on with word 0; the same for word 2, where the jump leads behind itself; tell; count. */
const [ASKS, TELLS, COUNTS] = [0x80028000, 0xc0000000, 0xb0002002];

it.each([
  ["flow", ASKS, 1 + 256 * 0, "taken"],
  ["flow", ASKS, 1 + 256 * 2, "passed"],
  ["flow", TELLS, 2 + 256 * 3, "told"],
  ["flow", COUNTS, 2 + 256 * 3, null],
  ["over", 0x61800100, 0, "ended"],
  // The length of a follower's word is over.
  ["over", 0xa0800000, 0, null],
  ["state", 0x61800100, 0, null],
] as const)("an event %s of the word %i, with %i, is the decision: %s", (kind, word, other, what) => {
  const event: CarEvent = { tMs: 1000, car: 0, kind, why: "", word, other };
  expect(decisionOf(event)).toBe(what);
  expect(packLane([event], { beginMs: 0, endMs: 2000 }, 2000, 20).decisions).toEqual(what ? [{ tMs: 1000, what }] : []);
  expect(jumpTo([event], "decision", 0, true)).toBe(what && event);
});

describe("the window", () => {
  it("goes along with the present, a little ahead", () => {
    expect(windowAt(null, 20_000, 0, false)).toEqual({ beginMs: 0, endMs: 20_000 });
    const { beginMs, endMs } = windowAt(null, 20_000, 60_000, false);
    expect(endMs - beginMs).toBe(20_000);
    expect(endMs).toBeGreaterThan(60_000);
  });

  it("stays where it is while somebody scrubs in it, and follows where they leave it", () => {
    const seen = { beginMs: 10_000, endMs: 30_000 };
    expect(windowAt(seen, 20_000, 12_000, true)).toBe(seen);
    expect(windowAt(seen, 20_000, 5000, true)).toEqual({ beginMs: 0, endMs: 20_000 });
    expect(windowAt(seen, 10_000, 12_000, true)).toEqual({ beginMs: 7000, endMs: 17_000 });
  });
});

it("the axis has round times that don't meet", () => {
  expect(ticksOf({ beginMs: 500, endMs: 10_500 }, 640)).toEqual({
    stepMs: 1000,
    atMs: [1000, 2000, 3000, 4000, 5000, 6000, 7000, 8000, 9000, 10_000],
  });
});
