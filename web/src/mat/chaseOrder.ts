/** In which order the view from behind a car is painted, and what would hide the car that is looked after. */

import type { Point } from "./document";
import { aheadOf, type Eye } from "./perspective";

/** What stands on the floor. */
export interface Solid {
  /** How far its middle is ahead of the camera, and the farthest of its corners from the middle, in metres. */
  ahead: number;
  reach: number;
  /** Both ends of a wall, or the corners of an outline. */
  footprint: readonly Point[];
  paint: () => void;
}

/** A car, which is as good as a point. */
export interface SeenCar {
  ahead: number;
  at: Point;
  paint: () => void;
}

/** This far the line of sight goes on behind a car, as a share of its length. */
const BEYOND = 20;
const JUST = 1e-6;

const turn = ([ax, ay]: Point, [bx, by]: Point, [cx, cy]: Point) => (bx - ax) * (cy - ay) - (by - ay) * (cx - ax);

function cross(a: Point, b: Point, c: Point, d: Point): boolean {
  return turn(a, b, c) > 0 !== turn(a, b, d) > 0 && turn(c, d, a) > 0 !== turn(c, d, b) > 0;
}

function edgesCrossed(footprint: readonly Point[], a: Point, b: Point): number {
  const edges = footprint.length > 2 ? footprint.length : footprint.length - 1;
  let crossed = 0;
  for (let k = 0; k < edges; k++) if (cross(footprint[k]!, footprint[(k + 1) % footprint.length]!, a, b)) crossed += 1;
  return crossed;
}

/** Whether something stands between the camera and a point of the floor, or around the camera. */
export function isBetween(footprint: readonly Point[], eye: Eye, at: Point): boolean {
  return edgesCrossed(footprint, [eye.x, eye.y], at) > 0;
}

export function solidAt(eye: Eye, [x, y]: Point, footprint: readonly Point[], paint: () => void): Solid {
  const reach = Math.max(...footprint.map(([cx, cy]) => Math.hypot(cx - x, cy - y)));
  return { ahead: aheadOf(eye, x, y), reach, footprint, paint };
}

/** How far ahead a car has to come in the order: before all that hides it, after all that it stands in front of. */
function placeOf({ ahead, at }: SeenCar, from: Point, things: readonly Solid[]): number {
  const beyond: Point = [at[0] + (at[0] - from[0]) * BEYOND, at[1] + (at[1] - from[1]) * BEYOND];
  let [most, least] = [ahead, 0];
  for (const thing of things) {
    // All of it is nearer than the car, or all of it is farther.
    if (Math.abs(thing.ahead - ahead) > thing.reach) continue;
    if (edgesCrossed(thing.footprint, from, at)) least = Math.max(least, thing.ahead + JUST);
    else if (edgesCrossed(thing.footprint, at, beyond)) most = Math.min(most, thing.ahead - JUST);
  }
  return Math.max(most, least);
}

/** All that is painted, the farthest first. The middle of a wall or house says not enough of a car beside it. */
export function paintOrder(eye: Eye, things: readonly Solid[], cars: readonly SeenCar[]): { paint: () => void }[] {
  const placed = cars.map((car) => ({ ahead: placeOf(car, [eye.x, eye.y], things), paint: car.paint }));
  return [...things, ...placed].sort((a, b) => b.ahead - a.ahead);
}
