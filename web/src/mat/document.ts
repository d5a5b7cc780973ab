/** Edits of a mat document: each returns a new document and leaves the old one unchanged. */

import { type Disc, FLAT, type FloorName, type Line, type Mat, type Person, type Point, type Polygon, SHAPES, type Wall } from "../generated/world";

export { FLOOR_NAMES, SHAPES } from "../generated/world";
export type { Car, Crowd, Disc, FloorName, Line, Mat, Person, Point, Polygon, Voice, Wall } from "../generated/world";

export type FurnitureKind = keyof typeof SHAPES;
type Pieces = { [K in FurnitureKind]: NonNullable<Mat[K]>[number] };
export type Piece = Pieces[FurnitureKind];

/** The lowest first: cars drive over what is flat. */
export const FURNITURE = Object.keys(SHAPES) as readonly FurnitureKind[];

/** Whether a kind of piece is a mark on the floor, in nobody's way. */
export function isFlat(kind: FurnitureKind): boolean {
  return (FLAT as readonly FurnitureKind[]).includes(kind);
}

/** A piece of furniture by its place in the document's list. */
export interface PieceId {
  kind: FurnitureKind;
  place: number;
}

export function listOf<K extends FurnitureKind>(mat: Mat, kind: K): readonly Pieces[K][] {
  return (mat[kind] as readonly Pieces[K][] | undefined) ?? [];
}

export function floorOf(mat: Mat | null): FloorName {
  return mat?.floor ?? "table";
}

/** Whether two mats are the same to drive on, whatever they look like. */
export function drivesLike(a: Mat, b: Mat): boolean {
  return JSON.stringify({ ...a, floor: undefined }) === JSON.stringify({ ...b, floor: undefined });
}

export function pieceOf(mat: Mat, id: PieceId): Piece | undefined {
  return listOf(mat, id.kind)[id.place];
}

export function without<T extends object>(whole: T, ...keys: (keyof T)[]): T {
  const rest = { ...whole };
  for (const key of keys) Reflect.deleteProperty(rest, key);
  return rest;
}

export function withList(mat: Mat, kind: FurnitureKind, pieces: readonly Piece[]): Mat {
  return pieces.length ? { ...mat, [kind]: pieces } : without(mat, kind);
}

function withPiece(mat: Mat, { kind, place }: PieceId, piece: Piece): Mat {
  return withList(mat, kind, listOf(mat, kind).with(place, piece));
}

/** Round metres to whole millimetres. */
export function rounded(metres: number): number {
  return Math.round(metres * 1000) / 1000;
}

function shift([x, y]: Point, dx: number, dy: number): Point {
  return [rounded(x + dx), rounded(y + dy)];
}

/** The points of a piece that can be dragged; a round one has one, on its rim. */
export function handlesOf(kind: FurnitureKind, piece: Piece): Point[] {
  switch (SHAPES[kind]) {
    case "ends":
      return [(piece as Wall).from_m, (piece as Wall).to_m];
    case "corners":
    case "line":
      return [...pointsOf(piece as Polygon | Line)];
    case "walk":
      return (piece as Person).path.map(([, x, y]) => [x, y]);
    case "round": {
      const { centre_m, radius_m } = piece as Disc;
      return [[centre_m[0] + radius_m, centre_m[1]]];
    }
  }
}

/** The piece with each of its points changed; of a round one its centre. */
export function mapPoints(kind: FurnitureKind, piece: Piece, change: (point: Point, place: number) => Point): Piece {
  switch (SHAPES[kind]) {
    case "ends":
      return { from_m: change((piece as Wall).from_m, 0), to_m: change((piece as Wall).to_m, 1) };
    case "corners":
    case "line":
      return withPoints(piece as Polygon | Line, pointsOf(piece as Polygon | Line).map(change));
    case "walk":
      return { ...(piece as Person), path: (piece as Person).path.map(([t, x, y], place) => [t, ...change([x, y], place)] as const) };
    case "round":
      return { ...(piece as Disc), centre_m: change((piece as Disc).centre_m, 0) };
  }
}

function pointsOf(piece: Polygon | Line): readonly Point[] {
  return "corners_m" in piece ? piece.corners_m : piece.points_m;
}

function withPoints(piece: Polygon | Line, points: readonly Point[]): Polygon | Line {
  return "corners_m" in piece ? { ...piece, corners_m: points } : { ...piece, points_m: points };
}

export function moved(mat: Mat, id: PieceId, dx: number, dy: number): Mat {
  const piece = pieceOf(mat, id);
  return piece ? withPiece(mat, id, mapPoints(id.kind, piece, (point) => shift(point, dx, dy))) : mat;
}

const SMALLEST_M = 0.02;

/** Drag one of a piece's handles to a point. */
export function reshaped(mat: Mat, id: PieceId, handle: number, [x, y]: Point): Mat {
  const piece = pieceOf(mat, id);
  if (!piece) return mat;
  if (SHAPES[id.kind] === "round") {
    const [cx, cy] = (piece as Disc).centre_m;
    return withPiece(mat, id, { ...(piece as Disc), radius_m: rounded(Math.max(SMALLEST_M, Math.hypot(x - cx, y - cy))) });
  }
  const point: Point = [rounded(x), rounded(y)];
  return withPiece(mat, id, mapPoints(id.kind, piece, (old, place) => (place === handle ? point : old)));
}

/** A person who walks to a point and back, so that the path can be repeated without a jump. */
const WALK_S = 4;
/** The radius of a new road's bends. */
export const BEND_M = 0.25;
/** A new piece of each shape. */
const NEW_PIECES: Record<(typeof SHAPES)[FurnitureKind], (x: number, y: number) => Piece> = {
  line: (x, y) => ({ points_m: [shift([x, y], -0.5, 0), shift([x, y], 0.5, 0)], bend_m: BEND_M }),
  ends: (x, y) => ({ from_m: [rounded(x - 0.4), rounded(y)], to_m: [rounded(x + 0.4), rounded(y)] }),
  round: (x, y) => ({ centre_m: [rounded(x), rounded(y)], radius_m: 0.15 }),
  corners: (x, y) => ({ corners_m: [shift([x, y], -0.2, -0.15), shift([x, y], 0.2, -0.15), shift([x, y], 0.2, 0.15), shift([x, y], -0.2, 0.15)] }),
  walk: (x, y) => ({
    path: [
      [0, rounded(x - 0.5), rounded(y)],
      [WALK_S, rounded(x + 0.5), rounded(y)],
      [2 * WALK_S, rounded(x - 0.5), rounded(y)],
    ],
    repeats: true,
  }),
};

export function newPiece(kind: FurnitureKind, [x, y]: Point): Piece {
  return NEW_PIECES[SHAPES[kind]](x, y);
}

export function added(mat: Mat, kind: FurnitureKind, at: Point): { mat: Mat; id: PieceId } {
  const pieces = listOf(mat, kind);
  return { mat: withList(mat, kind, [...pieces, newPiece(kind, at)]), id: { kind, place: pieces.length } };
}

export function removed(mat: Mat, { kind, place }: PieceId): Mat {
  return withList(mat, kind, listOf(mat, kind).toSpliced(place, 1));
}

const BESIDE_M = 0.2;

export function duplicated(mat: Mat, id: PieceId): { mat: Mat; id: PieceId } {
  const piece = pieceOf(mat, id);
  if (!piece) return { mat, id };
  const copy = mapPoints(id.kind, piece, (point) => shift(point, BESIDE_M, -BESIDE_M));
  const pieces = listOf(mat, id.kind);
  return { mat: withList(mat, id.kind, [...pieces, copy]), id: { kind: id.kind, place: pieces.length } };
}

/** Where a person is at a moment, as docs/mats.md says. */
export function personAt({ path, repeats }: Person, tMs: number): Point {
  const last = path.at(-1)!;
  const whole = last[0];
  let t = tMs / 1000;
  if (repeats && whole > 0) t %= whole;
  const next = path.findIndex(([at]) => at > t);
  if (next < 0) return [last[1], last[2]];
  const [t1, x1, y1] = path[next]!;
  const [t0, x0, y0] = path[Math.max(0, next - 1)]!;
  const share = t1 > t0 ? (t - t0) / (t1 - t0) : 1;
  return [x0 + (x1 - x0) * share, y0 + (y1 - y0) * share];
}

/** The share of frames that flipped bits destroy on the way to one receiver; a frame has 32 bits. */
export function lossOf(mat: Mat): number {
  return 1 - (1 - (mat.physics?.bit_error_rate ?? 0)) ** 32;
}

export function withLoss(mat: Mat, share: number): Mat {
  const physics = without(mat.physics ?? {}, "bit_error_rate");
  const rate = Number((1 - (1 - share) ** (1 / 32)).toPrecision(4));
  return { ...mat, physics: share > 0 ? { ...physics, bit_error_rate: rate } : physics };
}

/** Between two points of a person's path. */
const SHORTEST_S = 0.1;
/** How far a person walks, or a road goes, on to a point that is new at its end. */
const ON_M = 0.5;
const LONGEST_S = 100_000;
/** The least number of points, where it can differ. */
const LEAST: Partial<Record<(typeof SHAPES)[FurnitureKind], number>> = { walk: 1, line: 2, corners: 3 };

type Step = Person["path"][number];

/** Whether points can be added to this kind of piece. */
export function canGrow({ kind }: PieceId): boolean {
  return LEAST[SHAPES[kind]] !== undefined;
}

export function canLose({ kind }: PieceId, points: number): boolean {
  return points > (LEAST[SHAPES[kind]] ?? Infinity);
}

/** Add a point after this one: halfway to the next, or a little farther on at the end. */
export function withPointAfter(mat: Mat, id: PieceId, at: number): Mat {
  const piece = pieceOf(mat, id);
  if (!piece || !canGrow(id)) return mat;
  if (id.kind === "person") {
    const { path } = piece as Person;
    return withPiece(mat, id, { ...(piece as Person), path: path.toSpliced(at + 1, 0, stepAfter(path, at)) });
  }
  const points = pointsOf(piece as Polygon | Line);
  const isEnd = at === points.length - 1 && id.kind === "line" && !(piece as Line).closed;
  const fresh = isEnd ? onwards(points[at - 1]!, points[at]!) : halfway(points[at]!, points[(at + 1) % points.length]!);
  return withPiece(mat, id, withPoints(piece as Polygon | Line, points.toSpliced(at + 1, 0, fresh)));
}

function onwards([ax, ay]: Point, [bx, by]: Point): Point {
  const share = ON_M / (Math.hypot(bx - ax, by - ay) || 1);
  return shift([bx, by], (bx - ax) * share, (by - ay) * share);
}

function halfway([ax, ay]: Point, [bx, by]: Point): Point {
  return [rounded((ax + bx) / 2), rounded((ay + by) / 2)];
}

function stepAfter(path: Person["path"], at: number): Step {
  const [t, x, y] = path[at]!;
  const next = path[at + 1];
  if (next) return [rounded((t + next[0]) / 2), ...halfway([x, y], [next[1], next[2]])];
  return [rounded(t + 2), rounded(x + ON_M), y];
}

export function withoutPoint(mat: Mat, id: PieceId, at: number): Mat {
  const piece = pieceOf(mat, id);
  if (!piece || !canGrow(id)) return mat;
  if (id.kind === "person") {
    const left = (piece as Person).path.toSpliced(at, 1);
    // A path begins at 0 s, whichever point is its first.
    const begin = left[0]?.[0] ?? 0;
    return withPiece(mat, id, { ...(piece as Person), path: left.map(([t, x, y]) => [rounded(t - begin), x, y] as const) });
  }
  return withPiece(mat, id, withPoints(piece as Polygon | Line, pointsOf(piece as Polygon | Line).toSpliced(at, 1)));
}

/** Change the time of a person's point; later points move by the same time. */
export function retimed(mat: Mat, id: PieceId, at: number, seconds: number): Mat {
  const person = pieceOf(mat, id) as Person | undefined;
  const before = person?.path[at - 1];
  if (!person || !before) return mat;
  const time = rounded(Math.min(LONGEST_S, Math.max(before[0] + SHORTEST_S, seconds)));
  const later = time - person.path[at]![0];
  const path = person.path.map(([t, x, y], place) => [place < at ? t : rounded(t + later), x, y] as const);
  return withPiece(mat, id, { ...person, path });
}

/** Change what a piece has beside its points: how wide a line is, whether a walk is repeated. */
export function changed(mat: Mat, id: PieceId, change: Omit<Partial<Line>, "points_m"> | Omit<Partial<Person>, "path">): Mat {
  const piece = pieceOf(mat, id);
  return piece ? withPiece(mat, id, { ...piece, ...change }) : mat;
}
