/** What lies under the pointer. */

import { type Disc, FURNITURE, handlesOf, listOf, type Mat, type Person, personAt, pieceOf, type Piece, type PieceId, type Point, type Polygon, type Wall } from "./document";
import type { Drawn } from "./motion";
import type { Chosen } from "./store";

export type Grip = { car: number } | { piece: PieceId } | { piece: PieceId; handle: number };

export interface Sight {
  mat: Mat;
  drawn: Drawn;
  radiusM: number;
  chosen: Chosen;
  tMs: number;
}

/** Within `reach` metres; a chosen piece's handles come first, then cars, then what lies above. */
export function gripAt(sight: Sight, point: Point, reach: number): Grip | null {
  const { mat, chosen } = sight;
  if (chosen && "piece" in chosen) {
    const handle = handleAt(mat, chosen.piece, point, reach);
    if (handle >= 0) return { piece: chosen.piece, handle };
  }
  const car = carAt(sight, point, reach);
  if (car !== null) return { car };
  for (const kind of FURNITURE.toReversed()) {
    const place = listOf(mat, kind).findLastIndex((piece) => distanceTo(kind, piece, point, sight.tMs) <= reach);
    if (place >= 0) return { piece: { kind, place } };
  }
  return null;
}

function handleAt(mat: Mat, id: PieceId, point: Point, reach: number): number {
  const piece = pieceOf(mat, id);
  return piece ? handlesOf(id.kind, piece).findIndex((each) => distance(each, point) <= reach) : -1;
}

function carAt({ drawn, radiusM }: Sight, [x, y]: Point, reach: number): number | null {
  let nearest: number | null = null;
  let least = Math.max(radiusM, reach);
  for (let k = 0; k < drawn.x.length; k++) {
    const away = Math.hypot(drawn.x[k]! - x, drawn.y[k]! - y);
    if (away > least) continue;
    nearest = k;
    least = away;
  }
  return nearest;
}

const PERSON_M = 0.2;

function distanceTo(kind: PieceId["kind"], piece: Piece, point: Point, tMs: number): number {
  if (kind === "wall") return distanceToLine((piece as Wall).from_m, (piece as Wall).to_m, point);
  if (kind === "disc") return distance((piece as Disc).centre_m, point) - (piece as Disc).radius_m;
  if (kind === "person") return distance(personAt(piece as Person, tMs), point) - PERSON_M;
  const { corners_m } = piece as Polygon;
  if (isInside(corners_m, point)) return 0;
  return Math.min(...corners_m.map((corner, k) => distanceToLine(corner, corners_m[(k + 1) % corners_m.length]!, point)));
}

function distance([ax, ay]: Point, [bx, by]: Point): number {
  return Math.hypot(ax - bx, ay - by);
}

function distanceToLine(from: Point, to: Point, point: Point): number {
  const [dx, dy] = [to[0] - from[0], to[1] - from[1]];
  const along = ((point[0] - from[0]) * dx + (point[1] - from[1]) * dy) / (dx * dx + dy * dy || 1);
  const share = Math.min(1, Math.max(0, along));
  return distance([from[0] + dx * share, from[1] + dy * share], point);
}

function isInside(corners: readonly Point[], [x, y]: Point): boolean {
  let inside = false;
  corners.forEach(([ax, ay], k) => {
    const [bx, by] = corners[(k + 1) % corners.length]!;
    if (ay > y !== by > y && x < ax + ((y - ay) / (by - ay)) * (bx - ax)) inside = !inside;
  });
  return inside;
}
