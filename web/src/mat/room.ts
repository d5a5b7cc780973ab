/** Where there is room on a mat: new things are put beside what stands there, never onto it. */

import { type FurnitureKind, handlesOf, isFlat, type Mat, type Piece, piecesOf, type Point } from "./document";
import { newPiece } from "./edits";
import { chordsOf, closedWay, distance, distanceToChord, distanceToWay, wayOf } from "./ways";

/** Kept free around everything, in metres. */
const AIR_M = 0.05;
const STEP_M = 0.1;
const RINGS = 60;

export interface Standing {
  /** The centres of all cars, in metres: now, and at the beginning of a run. */
  cars: readonly Point[];
  radiusM: number;
}

export function isInside(corners: readonly Point[], [x, y]: Point): boolean {
  let inside = false;
  for (const [[ax, ay], [bx, by]] of chordsOf(closedWay(corners))) {
    if (ay > y !== by > y && x < ax + ((y - ay) / (by - ay)) * (bx - ax)) inside = !inside;
  }
  return inside;
}

/** From a point to the nearest part of a piece, of a line to its middle; negative or 0 inside it. Nobody stumbles over a person. */
export function distanceToPiece(piece: Piece, point: Point): number {
  if ("path" in piece) return Infinity;
  if ("from_m" in piece) return distanceToChord(piece.from_m, piece.to_m, point);
  if ("centre_m" in piece) return distance(piece.centre_m, point) - piece.radius_m;
  if ("points_m" in piece) return distanceToWay(wayOf(piece), point);
  return isInside(piece.corners_m, point) ? 0 : distanceToWay(closedWay(piece.corners_m), point);
}

/** The first car that stands beside its mat, which is allowed where the edge is open; null where none does. */
export function carBeside(mat: Mat): number | null {
  const car = (mat.car ?? []).findIndex(({ at_m }) => !isOnMat(mat, at_m, 0));
  return car < 0 ? null : car;
}

/** Whether a point is on the mat, so far from its edge at least. */
export function isOnMat({ size_m }: Mat, [x, y]: Point, air: number): boolean {
  return !size_m || (x >= air && y >= air && x <= size_m[0] - air && y <= size_m[1] - air);
}

/** Whether a car fits here: on the mat, beside all cars and all furniture. */
export function hasRoomForCar(mat: Mat, { cars, radiusM }: Standing, at: Point): boolean {
  const air = radiusM + AIR_M;
  if (!isOnMat(mat, at, air) || cars.some((car) => distance(car, at) < air + radiusM)) return false;
  return piecesOf(mat).every(({ id, piece }) => isFlat(id.kind) || distanceToPiece(piece, at) >= air);
}

/** Whether new furniture fits here: on the mat, and on no car. Pieces of furniture may touch each other. */
export function hasRoomForPiece(mat: Mat, { cars, radiusM }: Standing, kind: FurnitureKind, at: Point): boolean {
  const piece = newPiece(kind, at);
  if (!handlesOf(piece).every((point) => isOnMat(mat, point, 0))) return false;
  return isFlat(kind) || cars.every((car) => distanceToPiece(piece, car) >= radiusM + AIR_M);
}

/** The free point nearest to the wished one, in rings around it; the wished one where none is free. */
export function freePoint(wished: Point, isFree: (at: Point) => boolean): Point {
  if (isFree(wished)) return wished;
  for (let ring = 1; ring <= RINGS; ring++) {
    const points = 8 * ring;
    for (let k = 0; k < points; k++) {
      const angle = (2 * Math.PI * k) / points;
      const at: Point = [wished[0] + ring * STEP_M * Math.cos(angle), wished[1] + ring * STEP_M * Math.sin(angle)];
      if (isFree(at)) return at;
    }
  }
  return wished;
}
