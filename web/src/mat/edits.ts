/** Edits of a mat document: each returns a new document and leaves the old one unchanged. */

import { SHAPES } from "../generated/world";
import {
  type FurnitureKind,
  type Line,
  listOf,
  type Mat,
  type Person,
  type Piece,
  type PieceId,
  pieceOf,
  type Point,
  pointsOf,
  rounded,
  without,
} from "./document";

export function withList(mat: Mat, kind: FurnitureKind, pieces: readonly Piece[]): Mat {
  return pieces.length ? { ...mat, [kind]: pieces } : without(mat, kind);
}

/** The mat with a piece changed; the same mat where it has no such piece. */
function edited(mat: Mat, id: PieceId, change: (piece: Piece) => Piece): Mat {
  const piece = pieceOf(mat, id);
  return piece ? withList(mat, id.kind, listOf(mat, id.kind).with(id.place, change(piece))) : mat;
}

function shift([x, y]: Point, dx: number, dy: number): Point {
  return [rounded(x + dx), rounded(y + dy)];
}

/** The piece with each of its points changed; of a round one its centre. */
export function mapPoints(piece: Piece, change: (point: Point, place: number) => Point): Piece {
  if ("path" in piece) return { ...piece, path: piece.path.map(([t, x, y], place) => [t, ...change([x, y], place)] as const) };
  if ("from_m" in piece) return { from_m: change(piece.from_m, 0), to_m: change(piece.to_m, 1) };
  if ("centre_m" in piece) return { ...piece, centre_m: change(piece.centre_m, 0) };
  return withPoints(piece, pointsOf(piece).map(change));
}

/** A piece of any number of points with these; another piece as it is. */
function withPoints(piece: Piece, points: readonly Point[]): Piece {
  if ("corners_m" in piece) return { ...piece, corners_m: points };
  return "points_m" in piece ? { ...piece, points_m: points } : piece;
}

export function moved(mat: Mat, id: PieceId, dx: number, dy: number): Mat {
  return edited(mat, id, (piece) => mapPoints(piece, (point) => shift(point, dx, dy)));
}

const SMALLEST_M = 0.02;

/** Drag one of a piece's handles to a point. */
export function reshaped(mat: Mat, id: PieceId, handle: number, [x, y]: Point): Mat {
  const point: Point = [rounded(x), rounded(y)];
  return edited(mat, id, (piece) => {
    if (!("centre_m" in piece)) return mapPoints(piece, (old, place) => (place === handle ? point : old));
    const [cx, cy] = piece.centre_m;
    return { ...piece, radius_m: rounded(Math.max(SMALLEST_M, Math.hypot(x - cx, y - cy))) };
  });
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

function appended(mat: Mat, kind: FurnitureKind, piece: Piece): { mat: Mat; id: PieceId } {
  const pieces = listOf(mat, kind);
  return { mat: withList(mat, kind, [...pieces, piece]), id: { kind, place: pieces.length } };
}

export const added = (mat: Mat, kind: FurnitureKind, at: Point) => appended(mat, kind, newPiece(kind, at));

export function removed(mat: Mat, { kind, place }: PieceId): Mat {
  return withList(mat, kind, listOf(mat, kind).toSpliced(place, 1));
}

const BESIDE_M = 0.2;

export function duplicated(mat: Mat, id: PieceId): { mat: Mat; id: PieceId } {
  const piece = pieceOf(mat, id);
  return piece ? appended(mat, id.kind, mapPoints(piece, (point) => shift(point, BESIDE_M, -BESIDE_M))) : { mat, id };
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

type Waypoint = Person["path"][number];

/** Whether points can be added to this kind of piece. */
export function canGrow({ kind }: PieceId): boolean {
  return LEAST[SHAPES[kind]] !== undefined;
}

export function canLose({ kind }: PieceId, points: number): boolean {
  return points > (LEAST[SHAPES[kind]] ?? Infinity);
}

/** Add a point after this one: halfway to the next, or a little farther on at the end. */
export function withPointAfter(mat: Mat, id: PieceId, at: number): Mat {
  return edited(mat, id, (piece) => {
    if ("path" in piece) return { ...piece, path: piece.path.toSpliced(at + 1, 0, stepAfter(piece.path, at)) };
    const points = pointsOf(piece);
    const isEnd = at === points.length - 1 && "points_m" in piece && !piece.closed;
    const fresh = isEnd ? onwards(points[at - 1]!, points[at]!) : halfway(points[at]!, points[(at + 1) % points.length]!);
    return withPoints(piece, points.toSpliced(at + 1, 0, fresh));
  });
}

function onwards([ax, ay]: Point, [bx, by]: Point): Point {
  const share = ON_M / (Math.hypot(bx - ax, by - ay) || 1);
  return shift([bx, by], (bx - ax) * share, (by - ay) * share);
}

function halfway([ax, ay]: Point, [bx, by]: Point): Point {
  return [rounded((ax + bx) / 2), rounded((ay + by) / 2)];
}

function stepAfter(path: Person["path"], at: number): Waypoint {
  const [t, x, y] = path[at]!;
  const next = path[at + 1];
  if (next) return [rounded((t + next[0]) / 2), ...halfway([x, y], [next[1], next[2]])];
  return [rounded(t + 2), rounded(x + ON_M), y];
}

export function withoutPoint(mat: Mat, id: PieceId, at: number): Mat {
  return edited(mat, id, (piece) => {
    if (!("path" in piece)) return withPoints(piece, pointsOf(piece).toSpliced(at, 1));
    const left = piece.path.toSpliced(at, 1);
    // A path begins at 0 s, whichever point is its first.
    const begin = left[0]?.[0] ?? 0;
    return { ...piece, path: left.map(([t, x, y]) => [rounded(t - begin), x, y] as const) };
  });
}

/** Change the time of a person's point; later points move by the same time. */
export function retimed(mat: Mat, id: PieceId, at: number, seconds: number): Mat {
  return edited(mat, id, (piece) => {
    const path = "path" in piece ? piece.path : [];
    const before = path[at - 1];
    if (!before) return piece;
    const time = rounded(Math.min(LONGEST_S, Math.max(before[0] + SHORTEST_S, seconds)));
    const later = time - path[at]![0];
    return { ...piece, path: path.map(([t, x, y], place) => [place < at ? t : rounded(t + later), x, y] as const) };
  });
}

/** Change what a piece has beside its points: how wide a line is, whether a walk is repeated. */
export function changed(mat: Mat, id: PieceId, change: Omit<Partial<Line>, "points_m"> | Omit<Partial<Person>, "path">): Mat {
  return edited(mat, id, (piece) => ({ ...piece, ...change }));
}
