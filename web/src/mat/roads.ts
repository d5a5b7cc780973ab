/** Roads that are drawn by hand or laid in tiles, and cars put on them. Each edit returns a new document. */

import { type Car, type Line, listOf, type Mat, type PieceId, type Point, rounded } from "./document";
import { BEND_M, withList } from "./edits";
import { distanceToPiece, isOnMat } from "./room";
import { alongWay, closedWay, distance, distanceToChord, distanceToWay, lengthOf, LINE_M, wayOf } from "./ways";

/** A stroke may miss what is left of it by so much. */
const LOOSE_M = 0.05;
/** Nearer points would make a bend too tight to drive. */
const APART_M = 0.15;
/** Ends so near are meant to meet: the roads touch each other. */
export const REACH_M = 0.25;
/** How coarse a road is tried, and how round, until it misses the stroke by MISSED_M at most: the fewest corners first. */
const COARSE_M = [0.5, 0.35, 0.25, 0.17, 0.11, LOOSE_M];
const BENDS_M = [0.35, 0.6, 1, 2];
const MISSED_M = 0.07;
const FITTINGS = 6;
const MOST_SAMPLES = 120;
/** From the mat's edge, so that a car on the road doesn't touch it. */
const INSIDE_M = 0.15;
/** Of ends that meet without a hand. */
const EXACT_M = 0.002;

/** The road that a stroke of a hand means: straight lines and arcs, closed where its ends are near; null for a mere dot. */
export function roadOf(mat: Mat, stroke: readonly Point[]): Line | null {
  const step = Math.ceil(stroke.length / MOST_SAMPLES);
  const inside = stroke.filter((_, k) => k % step === 0 || k === stroke.length - 1).map((point) => onMat(mat, point));
  let road: Line | null = null;
  for (const looseM of COARSE_M) {
    const points = apart(simplified(inside, looseM));
    if (points.length < 2) return null;
    for (const bend_m of BENDS_M) {
      const line = closedUp({ points_m: points, bend_m }, REACH_M);
      road = missedM(line, inside) <= MISSED_M ? line : fitted(mat, line, inside);
      if (missedM(road, inside) <= MISSED_M) return whole(road);
    }
  }
  return road && whole(road);
}

const whole = (line: Line): Line => ({ ...line, points_m: line.points_m.map(([x, y]): Point => [rounded(x), rounded(y)]) });

/** How far the stroke is from a road, and the road from the stroke, at most. */
function missedM(line: Line, stroke: readonly Point[]): number {
  const way = wayOf(line);
  const drawn = line.closed ? closedWay(stroke) : stroke;
  return Math.max(...stroke.map((point) => distanceToWay(way, point)), ...way.map((point) => distanceToWay(drawn, point)));
}

/** The road with its corners moved until its arcs, which cut them, lie on the stroke. */
function fitted(mat: Mat, line: Line, stroke: readonly Point[]): Line {
  const nearest = (to: Point, points: readonly Point[]) => points.reduce((best, point) => (distance(point, to) < distance(best, to) ? point : best));
  let fit = line;
  for (let round = 0; round < FITTINGS; round++) {
    const way = wayOf(fit);
    const points_m = fit.points_m.map((corner, k): Point => {
      if (!fit.closed && (k === 0 || k === fit.points_m.length - 1)) return corner;
      const passed = nearest(corner, way);
      const [x, y] = nearest(passed, stroke);
      return onMat(mat, [corner[0] + x - passed[0], corner[1] + y - passed[1]]);
    });
    fit = { ...fit, points_m };
  }
  return fit;
}

function onMat({ size_m }: Mat, [x, y]: Point): Point {
  if (!size_m) return [x, y];
  const within = (value: number, size: number) => Math.max(Math.min(INSIDE_M, size / 2), Math.min(size - INSIDE_M, value));
  return [within(x, size_m[0]), within(y, size_m[1])];
}

/** As few of the points as lie within so many metres of all others (Douglas and Peucker). */
export function simplified(points: readonly Point[], looseM: number): readonly Point[] {
  const last = points.length - 1;
  if (last < 2) return points;
  let [farthest, at] = [looseM, 0];
  for (let k = 1; k < last; k++) {
    const far = distanceToChord(points[0]!, points[last]!, points[k]!);
    if (far > farthest) [farthest, at] = [far, k];
  }
  if (!at) return [points[0]!, points[last]!];
  return [...simplified(points.slice(0, at + 1), looseM).slice(0, -1), ...simplified(points.slice(at), looseM)];
}

/** Without points that are near the one before; the last one stays where it is. */
function apart(points: readonly Point[]): Point[] {
  const kept = points.slice(0, 1);
  const last = points.at(-1)!;
  for (const point of points.slice(1, -1)) if (distance(kept.at(-1)!, point) >= APART_M && distance(point, last) >= APART_M) kept.push(point);
  return distance(kept[0]!, last) >= APART_M || kept.length > 2 ? [...kept, last] : kept;
}

/** Without the points that lie on the straight way between their neighbours: they would make bends tight. */
function straightened({ points_m, ...line }: Line): Line {
  const count = points_m.length;
  const isNeeded = (here: Point, k: number) => {
    if (!line.closed && (k === 0 || k === count - 1)) return true;
    return distanceToChord(points_m[(k + count - 1) % count]!, points_m[(k + 1) % count]!, here) > EXACT_M;
  };
  const kept = points_m.filter(isNeeded);
  return { ...line, points_m: kept.length > (line.closed ? 2 : 1) ? kept : points_m };
}

/** The line, closed where its ends are near each other and it is long enough to go round. */
function closedUp(line: Line, reachM: number): Line {
  const { points_m: points } = line;
  const [first, last] = [points[0]!, points.at(-1)!];
  if (points.length < 4 || distance(first, last) > reachM || lengthOf(points) < 4 * REACH_M) return line;
  return { ...line, points_m: points.slice(0, -1), closed: true };
}

/** Both lines as one, where an end of one is near an end of the other; null where none is. */
function joined(old: Line, fresh: Line, reachM: number): Line | null {
  if (old.closed || fresh.closed || (old.width_m ?? LINE_M) !== (fresh.width_m ?? LINE_M)) return null;
  const turns = (points: readonly Point[]) => [points, points.toReversed()];
  const pairs = turns(old.points_m).flatMap((a) => turns(fresh.points_m).map((b) => ({ a, b, gapM: distance(a.at(-1)!, b[0]!) })));
  const best = pairs.reduce((least, pair) => (pair.gapM < least.gapM ? pair : least));
  if (best.gapM > reachM) return null;
  const points_m = [...best.a, ...best.b.slice(1)];
  return closedUp(straightened({ ...old, points_m, bend_m: Math.max(old.bend_m ?? 0, fresh.bend_m ?? 0) }), reachM);
}

/** Add a road; one whose end is near another's becomes one with it. */
export function withRoad(mat: Mat, road: Line, reachM: number): { mat: Mat; id: PieceId } {
  const lines = listOf(mat, "line");
  for (const [at, other] of lines.entries()) {
    const both = joined(other, road, reachM);
    if (both) return withRoad(withList(mat, "line", lines.toSpliced(at, 1)), both, reachM);
  }
  const line = road.closed ? straightened(road) : road;
  return { mat: withList(mat, "line", [...lines, line]), id: { kind: "line", place: lines.length } };
}

export const TILES = ["straight", "bend", "crossing"] as const;
export type Tile = (typeof TILES)[number];
const TILE_M = 0.5;
const HALF_M = TILE_M / 2;
/** The lines of each tile around its middle, in tiles. */
const TILE_LINES: Record<Tile, readonly (readonly Point[])[]> = {
  straight: [[[-1, 0], [1, 0]]],
  bend: [[[-1, 0], [0, 0], [0, -1]]],
  crossing: [[[-1, 0], [1, 0]], [[0, -1], [0, 1]]],
};

/** Turn a point around another by a number of right angles. */
function turned([x, y]: Point, [cx, cy]: Point, quarters: number): Point {
  let [dx, dy] = [x - cx, y - cy];
  for (let k = 0; k < quarters; k++) [dx, dy] = [-dy, dx];
  return [rounded(cx + dx), rounded(cy + dy)];
}

function middleOfTile([x, y]: Point): Point {
  const middle = (value: number) => rounded(Math.floor(value / TILE_M) * TILE_M + HALF_M);
  return [middle(x), middle(y)];
}

/** The lines of a tile in the square of the grid that holds a point, turned so that most of its ends meet roads. */
function tileAt(mat: Mat, tile: Tile, at: Point): Line[] {
  const middle = middleOfTile(at);
  const ends = listOf(mat, "line").flatMap(({ closed, points_m }) => (closed ? [] : [points_m[0]!, points_m.at(-1)!]));
  const ways = [0, 1, 2, 3].map((quarters) =>
    TILE_LINES[tile].map((points) => points.map(([dx, dy]) => turned([middle[0] + dx * HALF_M, middle[1] + dy * HALF_M], middle, quarters))),
  );
  const isEnd = (point: Point) => ends.some((end) => distance(end, point) < EXACT_M);
  const meets = (lines: Point[][]) => lines.flatMap((points) => [points[0]!, points.at(-1)!]).filter(isEnd).length;
  const best = ways.reduce((most, each) => (meets(each) > meets(most) ? each : most));
  return best.map((points_m) => ({ points_m, bend_m: BEND_M }));
}

/** Whether no road crosses the square of the grid that holds a point, and it is on the mat. */
export function hasRoomForTile(mat: Mat, at: Point): boolean {
  const middle = middleOfTile(at);
  return isOnMat(mat, middle, HALF_M) && listOf(mat, "line").every((line) => distanceToPiece(line, middle) > HALF_M / 2);
}

/** Lay a tile; its lines become one with those that they meet. */
export function withTile(mat: Mat, tile: Tile, at: Point): { mat: Mat; id: PieceId } {
  const before: { mat: Mat; id: PieceId } = { mat, id: { kind: "line", place: 0 } };
  return tileAt(mat, tile, at).reduce((laid, line) => withRoad(laid.mat, line, EXACT_M), before);
}

/** The road turned by a right angle around its middle. */
export function turnedRoad(mat: Mat, { place }: PieceId): Mat {
  const line = listOf(mat, "line")[place];
  if (!line) return mat;
  const middle = [0, 1].map((axis) => {
    const values = line.points_m.map((point) => point[axis]!);
    return (Math.min(...values) + Math.max(...values)) / 2;
  }) as unknown as Point;
  const points_m = line.points_m.map((point) => turned(point, middle, 1));
  return withList(mat, "line", listOf(mat, "line").with(place, { ...line, points_m }));
}

const SPACING_M = 0.3;
/** From the ends of an open road: the first car's sensors are still on it, and there is room for the last. */
const FROM_END_M = 0.1;

/**
 * The cars behind each other along a road, the leaders before the others; `closestM` apart at least. Cars for which it
 * has no room stay where they are.
 */
export function convoyOn(cars: readonly Car[], line: Line, closestM: number): { cars: Car[]; left: number } {
  const way = wayOf(line);
  const wholeM = lengthOf(way);
  const roomM = line.closed ? wholeM : Math.max(0, wholeM - 2 * FROM_END_M);
  const spaces = line.closed ? cars.length : cars.length - 1;
  const spacingM = Math.max(closestM, Math.min(SPACING_M, roomM / Math.max(1, spaces)));
  const most = Math.floor(roomM / spacingM + 1e-6) + (line.closed ? 0 : 1);
  const order = [...cars.keys()].sort((a, b) => Number(leads(cars[b]!)) - Number(leads(cars[a]!)) || a - b).slice(0, most);
  const firstM = line.closed ? (order.length - 1) * spacingM : FROM_END_M + (order.length - 1) * spacingM;
  const placed = [...cars];
  order.forEach((car, k) => {
    const { at, headingDeg } = alongWay(way, firstM - k * spacingM);
    placed[car] = { ...cars[car]!, at_m: [rounded(at[0]), rounded(at[1])], heading_deg: Math.round(headingDeg * 10) / 10 };
  });
  return { cars: placed, left: cars.length - order.length };
}

const leads = ({ role }: Car) => role === "leader";
