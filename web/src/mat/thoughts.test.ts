import { expect, it } from "vitest";
import { NO_INDEX } from "../api/world";
import type { CarEvent } from "../timeline/events";
import { pictureOf } from "./testPictures";
import { nudgeOf } from "./pointer";
import { type Circumstances, freePlace, MOST_THOUGHTS, thoughtsAt } from "./thoughts";

const RUNS = 1;
const FORWARD = 2;
const LATER = { tMs: 9000 };

function event(kind: CarEvent["kind"], more: Partial<CarEvent> = {}): CarEvent {
  return { tMs: 8500, car: 0, kind, why: "", word: 0, other: 0, ...more };
}

type Cars = Parameters<typeof pictureOf>[0];

function thoughts(cars: Cars, events: Record<number, CarEvent[]>, more: Partial<Circumstances> = {}, tMs = LATER) {
  const now = { picture: pictureOf(cars, tMs), leads: new Set([0]), rangeM: 1, radiusM: 0.075, eventsOf: (car: number) => events[car] ?? [], knownFromMs: 0, before: null, missesLine: () => false };
  return thoughtsAt({ ...now, ...more }).map(({ car, thought }) => [car, thought]);
}

const LEADER = { index: 1, flags: RUNS };
const SENDS = { 0: [event("frame")] };

it.each([
  ["nobody sends", [{ x: 0.5, index: NO_INDEX }], {}, "nothing"],
  ["the only sender is too far", [{ x: 1.5, index: NO_INDEX }], SENDS, "tooFar"],
  ["a sender is near and nothing came yet", [{ x: 0.5, index: NO_INDEX }], SENDS, "waiting"],
  ["it accepts no infrared", [{ x: 0.5, index: NO_INDEX }], { ...SENDS, 1: [event("lost", { why: "deaf" })] }, "deaf"],
  ["frames collide at it", [{ x: 0.5, index: NO_INDEX }], { ...SENDS, 1: [1, 2, 3].map(() => event("lost", { why: "collision" })) }, "collisions"],
] as [string, Cars, Record<number, CarEvent[]>, string][])("a car says why it stands: %s", (_, others, events, expected) => {
  expect(thoughts([LEADER, ...others], events)).toEqual([[1, expected]]);
});

it("a car that runs a word, or has just heard one, thinks nothing", () => {
  expect(thoughts([LEADER, { x: 5, index: 2, flags: RUNS }, { x: 0.4, index: NO_INDEX }], { ...SENDS, 2: [event("heard")] })).toEqual([]);
});

it("who passes words on is heard too", () => {
  const cars = [LEADER, { x: 0.9, index: 2, flags: RUNS }, { x: 1.8, index: NO_INDEX }];
  expect(thoughts(cars, SENDS)).toEqual([[2, "tooFar"]]);
  expect(thoughts(cars, { ...SENDS, 1: [event("frame")] })).toEqual([[2, "waiting"]]);
});

it("what comes later than the shown moment isn't known yet", () => {
  const late = { 0: [event("frame", { tMs: 20_000 })] };
  expect(thoughts([LEADER, { x: 1.5, index: NO_INDEX }], late)).toEqual([[1, "nothing"]]);
});

it("what is not stored anymore is not denied", () => {
  const cars = [LEADER, { x: 0.5, index: NO_INDEX }];
  expect(thoughts(cars, {}, { knownFromMs: 5000 })).toEqual([[1, "nothing"]]);
  expect(thoughts(cars, {}, { knownFromMs: 5001 })).toEqual([]);
});

it("a sender that loses many messages sends all the same", () => {
  const busy = [...Array.from({ length: 200 }, () => event("lost", { why: "sending" })), event("frame", { tMs: 8000 })];
  expect(thoughts([LEADER, { x: 1.5, index: NO_INDEX }], { 0: busy })).toEqual([[1, "tooFar"]]);
});

it("wheels that turn and lead nowhere are blocked, by a car or by a thing", () => {
  const cars = [{ ...LEADER, wheels: FORWARD }, { x: 0.15, index: 2, flags: RUNS }, { x: 3, index: 2, flags: RUNS, wheels: FORWARD }];
  const before = { tMs: 8000, x: [0, 0.15, 3], y: [0, 0, 0] };
  expect(thoughts(cars, {}, { before })).toEqual([[0, "blockedByCar"], [2, "blocked"]]);
  expect(thoughts(cars, {}, { before: { ...before, x: [-0.2, 0.15, 2.8] } })).toEqual([]);
});

it("a car that follows a line and sees none says so", () => {
  const cars = [LEADER, { x: 0.5, index: 2, flags: RUNS }, { x: 0.9, index: NO_INDEX }];
  expect(thoughts(cars, { ...SENDS, 2: [event("heard")] }, { missesLine: () => true })).toEqual([[0, "noLine"], [1, "noLine"]]);
});

it("few cars think at once, and none at the very beginning", () => {
  const crowd = [LEADER, ...Array.from({ length: 9 }, () => ({ x: 2, index: NO_INDEX }))];
  expect(thoughts(crowd, SENDS)).toHaveLength(MOST_THOUGHTS);
  expect(thoughts(crowd, SENDS, {}, { tMs: 200 })).toEqual([]);
});

it("a bubble stands above its car, or below it where a zone's name is above, or nowhere", () => {
  const box = (y: number) => ({ x: 100, y, width: 80, height: 20 }) as DOMRect;
  const [above, below] = [box(50), box(120)];
  expect(freePlace([above, below], [])).toBe(above);
  expect(freePlace([above, below], [box(72)])).toBe(below);
  expect(freePlace([above, below], [box(75)])).toBe(above);
  expect(freePlace([above, below], [box(72), box(110)])).toBeUndefined();
});

it("an arrow key moves what is chosen, less with Shift", () => {
  const nudge = (key: string, shiftKey = false) => nudgeOf({ key, shiftKey });
  expect(nudge("ArrowUp")).toEqual([0, 0.05]);
  expect(nudge("ArrowLeft", true)).toEqual([-0.01, 0]);
  expect(nudge("Enter")).toBeNull();
});
