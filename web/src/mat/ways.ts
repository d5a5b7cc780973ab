/** Where lines on the floor go: through their points, with rounded corners, as motorcade/mats/model.py has it. */

import type { Line, Point } from "./document";

export const LINE_M = 0.03;
/** How far a chord may be from the arc that it stands for. */
const SAGITTA_M = 0.0004;

/** A function that computes what it answers once for each object. */
export function once<Key extends object, Value>(compute: (key: Key) => Value): (key: Key) => Value {
  const known = new WeakMap<Key, Value>();
  return (key) => {
    const value = known.get(key) ?? compute(key);
    known.set(key, value);
    return value;
  };
}

/** The points of the line's middle, the first again where it is closed. */
export const wayOf = once(({ points_m: points, bend_m = 0, closed = false }: Line): readonly Point[] => {
  const count = points.length;
  if (count === 2) return points;
  const way = points.flatMap((here, at): readonly Point[] => {
    const isEnd = !closed && (at === 0 || at === count - 1);
    if (isEnd || bend_m === 0) return [here];
    return bend(points[(at + count - 1) % count]!, here, points[(at + 1) % count]!, bend_m);
  });
  return closed ? closedWay(way) : way;
});

/** The arc that touches both sides of a corner; it takes at most half of each. The corner itself where the way is straight. */
function bend(before: Point, corner: Point, after: Point, wishedM: number): readonly Point[] {
  const [toBefore, toAfter] = [direction(corner, before), direction(corner, after)];
  if (!toBefore || !toAfter) return [corner];
  const half = Math.acos(Math.max(-1, Math.min(1, toBefore[0] * toAfter[0] + toBefore[1] * toAfter[1]))) / 2;
  if (half < 1e-3 || half > Math.PI / 2 - 1e-3) return [corner];
  const mostM = Math.min(distance(corner, before), distance(corner, after)) / 2;
  const fromCornerM = Math.min(wishedM / Math.tan(half), mostM);
  const radius = fromCornerM * Math.tan(half);
  const begin: Point = [corner[0] + toBefore[0] * fromCornerM, corner[1] + toBefore[1] * fromCornerM];
  const toMiddle: Point = [toBefore[0] + toAfter[0], toBefore[1] + toAfter[1]];
  const away = fromCornerM / Math.cos(half) / Math.hypot(...toMiddle);
  const centre: Point = [corner[0] + toMiddle[0] * away, corner[1] + toMiddle[1] * away];
  const first = Math.atan2(begin[1] - centre[1], begin[0] - centre[0]);
  const isLeft = toBefore[0] * toAfter[1] - toBefore[1] * toAfter[0] <= 0;
  const turn = (Math.PI - 2 * half) * (isLeft ? 1 : -1);
  const step = radius > SAGITTA_M ? 2 * Math.acos(Math.max(0, 1 - SAGITTA_M / radius)) : Math.PI;
  const pieces = Math.max(1, Math.ceil(Math.abs(turn) / step));
  return Array.from({ length: pieces + 1 }, (_, piece): Point => {
    const angle = first + (turn * piece) / pieces;
    return [centre[0] + radius * Math.cos(angle), centre[1] + radius * Math.sin(angle)];
  });
}

export function distance([ax, ay]: Point, [bx, by]: Point): number {
  return Math.hypot(ax - bx, ay - by);
}

function direction(here: Point, there: Point): Point | null {
  const length = distance(here, there);
  return length ? [(there[0] - here[0]) / length, (there[1] - here[1]) / length] : null;
}

/** The corners of a circle. */
export function ringOf([x, y]: Point, radius: number, parts = 24): Point[] {
  return Array.from({ length: parts }, (_, k): Point => {
    const angle = (2 * Math.PI * k) / parts;
    return [x + radius * Math.cos(angle), y + radius * Math.sin(angle)];
  });
}

/** A way that comes back to its beginning. */
export const closedWay = (way: readonly Point[]): Point[] => [...way, way[0]!];

/** The chords of a way, each from one point to the next. */
export const chordsOf = (way: readonly Point[]): [Point, Point][] => way.slice(1).map((to, k) => [way[k]!, to]);

/** Above 0 where the way from `a` by `b` to `c` turns left, below 0 where it turns right. */
export const turnOf = ([ax, ay]: Point, [bx, by]: Point, [cx, cy]: Point): number => (bx - ax) * (cy - ay) - (by - ay) * (cx - ax);

/** Whether a chord from `a` to `b` and one from `c` to `d` cross. */
function doCross(a: Point, b: Point, c: Point, d: Point): boolean {
  return turnOf(a, b, c) > 0 !== turnOf(a, b, d) > 0 && turnOf(c, d, a) > 0 !== turnOf(c, d, b) > 0;
}

/** Whether a chord crosses an outline, or a wall of two points. */
export function crosses(footprint: readonly Point[], a: Point, b: Point): boolean {
  const sides = chordsOf(footprint.length > 2 ? closedWay(footprint) : footprint);
  return sides.some(([c, d]) => doCross(a, b, c, d));
}

/** The point that lies a share of the way from one point to another. */
export const pointBetween = ([ax, ay]: Point, [bx, by]: Point, share: number): Point => [ax + (bx - ax) * share, ay + (by - ay) * share];

export const lengthOf = (way: readonly Point[]): number => chordsOf(way).reduce((sum, [from, to]) => sum + distance(from, to), 0);

export function distanceToChord(from: Point, to: Point, point: Point): number {
  const [dx, dy] = [to[0] - from[0], to[1] - from[1]];
  const along = ((point[0] - from[0]) * dx + (point[1] - from[1]) * dy) / (dx * dx + dy * dy || 1);
  return distance(pointBetween(from, to, Math.min(1, Math.max(0, along))), point);
}

/** From a point to the nearest part of a way. */
export const distanceToWay = (way: readonly Point[], point: Point): number => Math.min(...chordsOf(way).map(([from, to]) => distanceToChord(from, to, point)));

/** The point of a way so many metres behind its beginning, and where it leads there, in degrees. */
export function alongWay(way: readonly Point[], metres: number): { at: Point; headingDeg: number } {
  let left = metres;
  for (let k = 1; k < way.length; k++) {
    const [from, to] = [way[k - 1]!, way[k]!];
    const length = distance(from, to);
    if (left > length && k < way.length - 1) {
      left -= length;
      continue;
    }
    const share = length ? Math.min(1, left / length) : 0;
    const headingDeg = (Math.atan2(to[1] - from[1], to[0] - from[0]) * 180) / Math.PI;
    return { at: pointBetween(from, to, share), headingDeg };
  }
  return { at: way[0]!, headingDeg: 0 };
}

/** The outline of a band of a width along a way: its left side there, and its right side back. */
export function bandAlong(way: readonly Point[], widthM: number): Point[] {
  const isClosed = way.length > 2 && distance(way[0]!, way.at(-1)!) < 1e-9;
  const side = (sign: 1 | -1) =>
    way.map(([x, y], k): Point => {
      const before = way[k - 1] ?? (isClosed ? way.at(-2)! : null);
      const after = way[k + 1] ?? (isClosed ? way[1]! : null);
      const [came, goes] = [before && direction(before, [x, y]), after && direction([x, y], after)];
      const [dx, dy] = [(came?.[0] ?? 0) + (goes?.[0] ?? 0), (came?.[1] ?? 0) + (goes?.[1] ?? 0)];
      const length = Math.hypot(dx, dy) || 1;
      // In a corner the band's edge is farther from its middle.
      const wide = (widthM / 2) * Math.min(2, came && goes ? 2 / length : 1);
      return [x - (sign * dy * wide) / length, y + (sign * dx * wide) / length];
    });
  return [...side(1), ...side(-1).reverse()];
}
