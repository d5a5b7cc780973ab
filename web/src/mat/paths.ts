/** Points of a piece that come and go: a box's corners, and where a person is when. */

import { type Mat, type Person, pieceOf, type PieceId, type Point, type Polygon, rounded, withPiece } from "./document";

/** Between two points of a person's path. */
const SHORTEST_S = 0.1;
/** How far a person walks on to a point that is new at the path's end. */
const ON_M = 0.5;
const LONGEST_S = 100_000;
const LEAST: Partial<Record<PieceId["kind"], number>> = { person: 1, polygon: 3 };

type Step = Person["path"][number];

/** Whether points of this kind of piece can be added; `canLose` tells of taking one away. */
export function canGrow({ kind }: PieceId): boolean {
  return LEAST[kind] !== undefined;
}

export function canLose({ kind }: PieceId, points: number): boolean {
  return points > (LEAST[kind] ?? Infinity);
}

/** Another point behind this one: halfway to the next, or a little farther on where none follows. */
export function withPointAfter(mat: Mat, id: PieceId, at: number): Mat {
  const piece = pieceOf(mat, id);
  if (piece && id.kind === "person") {
    const { path } = piece as Person;
    return withPiece(mat, id, { ...(piece as Person), path: path.toSpliced(at + 1, 0, stepAfter(path, at)) });
  }
  if (!piece || id.kind !== "polygon") return mat;
  const { corners_m } = piece as Polygon;
  const middle = halfway(corners_m[at]!, corners_m[(at + 1) % corners_m.length]!);
  return withPiece(mat, id, { corners_m: corners_m.toSpliced(at + 1, 0, middle) });
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
  if (piece && id.kind === "person") {
    const left = (piece as Person).path.toSpliced(at, 1);
    // A path begins at 0 s, whichever point is its first.
    const begin = left[0]?.[0] ?? 0;
    return withPiece(mat, id, { ...(piece as Person), path: left.map(([t, x, y]) => [rounded(t - begin), x, y] as const) });
  }
  if (!piece || id.kind !== "polygon") return mat;
  return withPiece(mat, id, { corners_m: (piece as Polygon).corners_m.toSpliced(at, 1) });
}

/** The person is at this point at another time; the points behind keep their distance from it in time. */
export function retimed(mat: Mat, id: PieceId, at: number, seconds: number): Mat {
  const person = pieceOf(mat, id) as Person | undefined;
  const before = person?.path[at - 1];
  if (!person || !before) return mat;
  const time = rounded(Math.min(LONGEST_S, Math.max(before[0] + SHORTEST_S, seconds)));
  const later = time - person.path[at]![0];
  const path = person.path.map(([t, x, y], place) => [place < at ? t : rounded(t + later), x, y] as const);
  return withPiece(mat, id, { ...person, path });
}

export function withRepeats(mat: Mat, id: PieceId, repeats: boolean): Mat {
  const person = pieceOf(mat, id) as Person | undefined;
  return person ? withPiece(mat, id, { ...person, repeats }) : mat;
}
