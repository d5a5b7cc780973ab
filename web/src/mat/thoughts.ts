/** What a car thinks: one short sentence a car, from the facts of a moment and the events before it. */

import { Flag, NO_INDEX, type Picture } from "../api/world";
import type { CarEvent } from "../timeline/events";

export type Thought = "blockedByCar" | "blocked" | "noLine" | "tooFar" | "deaf" | "collisions" | "nothing" | "waiting" | "noProgram";

export interface Circumstances {
  picture: Picture;
  leads: ReadonlySet<number>;
  rangeM: number;
  radiusM: number;
  /** Whether a car's word has it follow a line, and it sees none. */
  missesLine: (car: number) => boolean;
  /** A car's events, newest first. */
  eventsOf: (car: number) => Iterable<CarEvent>;
  /** Of the time before, some events may be missing. */
  knownFromMs: number;
  /** Where the cars were a moment ago; null right after a jump in time. */
  before: { tMs: number; x: ArrayLike<number>; y: ArrayLike<number> } | null;
}

/** So many at once can be read. */
export const MOST_THOUGHTS = 5;
/** Nobody thinks before this time: the first messages are on their way. */
const BEGIN_MS = 1500;
/** What is older than this has been forgotten. */
const RECENT_MS = 4000;
/** A car whose wheels turn moves farther than this in a second. */
const STUCK_M = 0.01;
const STUCK_MS = 700;
/** First what can be seen, then what can be changed. */
const ORDER: readonly Thought[] = ["blockedByCar", "blocked", "noLine", "tooFar", "deaf", "collisions", "noProgram", "nothing", "waiting"];

interface Lately {
  heard: boolean;
  sent: boolean;
  deaf: number;
  collided: number;
}

/** What a car has sent, heard and lost lately. */
function lately(events: Iterable<CarEvent>, tMs: number): Lately {
  const sum = { heard: false, sent: false, deaf: 0, collided: 0 };
  for (const event of events) {
    // What happens in the tick that begins now has not happened yet.
    if (event.tMs >= tMs) continue;
    if (event.tMs < tMs - RECENT_MS) break;
    if (event.kind === "heard") sum.heard = true;
    if (event.kind === "frame") sum.sent = true;
    if (event.kind === "lost" && event.why === "deaf") sum.deaf += 1;
    if (event.kind === "lost" && event.why === "collision") sum.collided += 1;
  }
  return sum;
}

function isStuck({ picture, before }: Circumstances, k: number): boolean {
  if (!before || picture.tMs - before.tMs < STUCK_MS) return false;
  const [speed, way] = [picture.wheels[k]! & 3, picture.wheels[k]! >> 2];
  // To turn on the spot leads nowhere by intention.
  if (!speed || way !== 0) return false;
  return Math.hypot(picture.x[k]! - before.x[k]!, picture.y[k]! - before.y[k]!) < STUCK_M;
}

function hasCarAhead({ picture, radiusM }: Circumstances, k: number): boolean {
  const [x, y, heading] = [picture.x[k]!, picture.y[k]!, picture.heading[k]!];
  for (let other = 0; other < picture.cars; other++) {
    if (other === k) continue;
    const [dx, dy] = [picture.x[other]! - x, picture.y[other]! - y];
    const ahead = dx * Math.cos(heading) + dy * Math.sin(heading);
    if (ahead > 0 && Math.hypot(dx, dy) < 2.6 * radiusM) return true;
  }
  return false;
}

function thoughtOf(now: Circumstances, k: number, happened: readonly Lately[] | null): Thought | null {
  const { picture, leads, rangeM } = now;
  if (isStuck(now, k)) return hasCarAhead(now, k) ? "blockedByCar" : "blocked";
  const isIdle = picture.index[k] === NO_INDEX || !(picture.flags[k]! & Flag.runs);
  if (!isIdle) return now.missesLine(k) ? "noLine" : null;
  if (leads.has(k)) return picture.index[k] === NO_INDEX ? "noProgram" : null;
  if (!happened) return null;
  const { heard, deaf, collided } = happened[k]!;
  if (heard) return null;
  if (!happened.some(({ sent }) => sent)) return "nothing";
  const inReach = happened.some(({ sent }, each) => sent && each !== k && Math.hypot(picture.x[each]! - picture.x[k]!, picture.y[each]! - picture.y[k]!) <= rangeM);
  if (!inReach) return "tooFar";
  if (deaf) return "deaf";
  return collided > 2 ? "collisions" : "waiting";
}

/** The thoughts of at most five cars, the most telling ones first. */
export function thoughtsAt(now: Circumstances): { car: number; thought: Thought }[] {
  const { picture } = now;
  if (picture.tMs < BEGIN_MS) return [];
  const cars = Array.from({ length: picture.cars }, (_, k) => k);
  const isKnown = now.knownFromMs <= Math.max(0, picture.tMs - RECENT_MS);
  const happened = isKnown ? cars.map((k) => lately(now.eventsOf(k), picture.tMs)) : null;
  const all = cars.flatMap((car) => {
    const thought = thoughtOf(now, car, happened);
    return thought ? [{ car, thought }] : [];
  });
  return all.sort((a, b) => ORDER.indexOf(a.thought) - ORDER.indexOf(b.thought) || a.car - b.car).slice(0, MOST_THOUGHTS);
}

/** Between two bubbles. */
const AIR_PX = 4;

/** The first of the places of a bubble that meets none that is taken. */
export function freePlace(places: readonly DOMRect[], taken: readonly DOMRect[]): DOMRect | undefined {
  const meet = (a: DOMRect, b: DOMRect) =>
    a.x < b.x + b.width + AIR_PX && b.x < a.x + a.width + AIR_PX && a.y < b.y + b.height + AIR_PX && b.y < a.y + a.height + AIR_PX;
  return places.find((place) => taken.every((other) => !meet(other, place)));
}
