/** The cars of a mat: single ones and crowds. Single cars have the first numbers, then each crowd in turn. */

import { type Car, type Crowd, FURNITURE, listOf, type Mat, type Point, rounded, without } from "./document";
import { mapPoints, withList } from "./edits";

export interface CarPoses {
  x: ArrayLike<number>;
  y: ArrayLike<number>;
  /** Radians. */
  heading: ArrayLike<number>;
}

/** Larger crowds are not written car by car: the document would be too long for a link. */
export const MOST_ONE_BY_ONE = 1001;
const DEFAULT_SPACING_M = 0.25;
/** Cars 150 mm across that can just turn beside each other. */
const CLOSEST_M = 0.2;
/** Obstacles and the clearance around cars leave less room than the area suggests. */
export const ROOM_TO_SPARE = 1.35;

export function carsOf(mat: Mat): { leaders: number; followers: number } {
  const single = mat.car ?? [];
  const crowds = mat.crowd ?? [];
  const leaders =
    single.filter(({ role }) => role === "leader").length + crowds.reduce((sum, crowd) => sum + (crowd.leaders ?? 0), 0);
  const all = single.length + crowds.reduce((sum, crowd) => sum + crowd.cars, 0);
  return { leaders, followers: all - leaders };
}

function toDegrees(radians: number): number {
  return Math.round((radians * 180) / Math.PI) || 0;
}

/** The same cars with the same numbers, each written on its own at its present place. */
export function oneByOne(mat: Mat, at: CarPoses, leads: ReadonlySet<number>): Mat {
  const car = Array.from({ length: at.x.length }, (_, k): Car => {
    const heading_deg = toDegrees(at.heading[k]!);
    return {
      at_m: [rounded(at.x[k]!), rounded(at.y[k]!)],
      ...(heading_deg !== 0 && { heading_deg }),
      ...(leads.has(k) && { role: "leader" as const }),
    };
  });
  return { ...without(mat, "crowd"), car };
}

/** Change the number of followers: first in crowds, then among cars placed one by one. `spare`: area for each cell. */
export function withFollowers(mat: Mat, wished: number, spare = ROOM_TO_SPARE): Mat {
  const single = mat.car ?? [];
  const placed = single.filter(({ role }) => role !== "leader").length;
  const crowds = [...(mat.crowd ?? [])];
  let left = wished - placed - crowds.reduce((sum, crowd) => sum + crowd.cars - (crowd.leaders ?? 0), 0);
  while (left < 0 && crowds.length) {
    const last = crowds.pop()!;
    const stay = Math.max(0, last.cars - (last.leaders ?? 0) + left);
    left += last.cars - (last.leaders ?? 0) - stay;
    if (stay + (last.leaders ?? 0) > 0) crowds.push({ ...last, cars: stay + (last.leaders ?? 0) });
    if (stay > 0 || (last.leaders ?? 0) > 0) break;
  }
  const changed = withCrowds({ ...mat, car: left < 0 ? withoutLast(single, -left) : single }, crowds);
  return left > 0 ? withMore(changed, left, spare) : changed;
}

function withCrowds(mat: Mat, crowd: readonly Crowd[]): Mat {
  return crowd.length ? { ...mat, crowd } : without(mat, "crowd");
}

function withoutLast(cars: readonly Car[], count: number): Car[] {
  let left = count;
  return cars.toReversed().filter(({ role }) => role === "leader" || left-- <= 0).reverse();
}

/** Add followers to the last crowd: within its area if they fit, else all over the mat, which grows if needed. */
function withMore(mat: Mat, more: number, spare: number): Mat {
  const crowds = mat.crowd ?? [];
  const last: Crowd = crowds.at(-1) ?? { cars: 0 };
  const cars = last.cars + more;
  const spacing = last.spacing_m ?? DEFAULT_SPACING_M;
  const others = crowds.slice(0, -1);
  if (last.size_m && room(last.size_m, spacing) >= cars * spare) return withCrowds(mat, [...others, { ...last, cars }]);
  const anywhere = without(last, "corner_m", "size_m");
  if (!mat.size_m) {
    const side = rounded(Math.sqrt(cars * spare) * spacing + spacing);
    const [x, y] = mat.car?.[0]?.at_m ?? [0, 0];
    const corner_m: Point = [rounded(x - side / 2), rounded(y - side / 2)];
    return withCrowds(mat, [...others, { ...anywhere, cars, spacing_m: spacing, corner_m, size_m: [side, side] }]);
  }
  const [width, height] = mat.size_m;
  const even = Math.sqrt((width * height) / (cars * spare));
  const spacing_m = Math.floor(Math.max(CLOSEST_M, Math.min(spacing, even)) * 100) / 100;
  const factor = Math.max(1, spacing_m / even);
  return withCrowds(factor > 1 ? grown(mat, factor) : mat, [...others, { ...anywhere, cars, spacing_m }]);
}

function room([width, height]: Point, spacing: number): number {
  // 1.2 / 0.4 is a little less than 3 in floating point.
  return Math.floor(width / spacing + 1e-9) * Math.floor(height / spacing + 1e-9);
}

/** A larger mat, with everything moved to its middle. */
function grown(mat: Mat, factor: number): Mat {
  const [width, height] = mat.size_m!;
  const size_m: Point = [Math.ceil(width * factor * 10) / 10, Math.ceil(height * factor * 10) / 10];
  return { ...shifted(mat, (size_m[0] - width) / 2, (size_m[1] - height) / 2), size_m };
}

function shifted(mat: Mat, dx: number, dy: number): Mat {
  const by = ([x, y]: Point): Point => [rounded(x + dx), rounded(y + dy)];
  let result = FURNITURE.reduce((changed, kind) => withList(changed, kind, listOf(mat, kind).map((piece) => mapPoints(piece, by))), mat);
  if (mat.voice) {
    result = { ...result, voice: mat.voice.map((voice) => (voice.centre_m ? { ...voice, centre_m: by(voice.centre_m) } : voice)) };
  }
  if (mat.car) result = { ...result, car: mat.car.map((car) => ({ ...car, at_m: by(car.at_m) })) };
  if (!mat.crowd) return result;
  return { ...result, crowd: mat.crowd.map((crowd) => (crowd.corner_m ? { ...crowd, corner_m: by(crowd.corner_m) } : crowd)) };
}

/** What the cars' start depends on: where it differs, the world must be built anew. */
export function beginning(mat: Mat): string {
  return JSON.stringify([mat.car, mat.crowd, mat.tick_ms, mat.size_m]);
}

/** The slider's scale: single cars at its left end, hundreds at its right. */
export const MOST_FOLLOWERS = 1000;
export const SLIDER_STEPS = 100;

export function followersAt(position: number): number {
  return Math.round(MOST_FOLLOWERS ** (position / SLIDER_STEPS) - 1 + position / SLIDER_STEPS);
}

export function positionOf(followers: number): number {
  let position = 0;
  while (position < SLIDER_STEPS && followersAt(position) < followers) position += 1;
  return position;
}
