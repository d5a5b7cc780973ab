/** What part of the plane is seen: the point in the middle, in metres, and how many pixels a metre takes. */

import type { MissionZone } from "../generated/messages";
import type { Mat, Point } from "./document";

export interface Camera {
  x: number;
  y: number;
  scale: number;
}

export interface Size {
  width: number;
  height: number;
}

export interface Box {
  left: number;
  bottom: number;
  right: number;
  top: number;
}

/** Half of a car of the classroom's profile, until the world says what its own are. */
export const RADIUS_M = 0.075;
/** No car is painted shorter where there are at most FEW_CARS: on a large mat it is larger than it is. */
const SHORTEST_PX = 24;
const LEAST_PX = 9;
export const FEW_CARS = 200;

export function toWorld(camera: Camera, size: Size, px: number, py: number): Point {
  return [camera.x + (px - size.width / 2) / camera.scale, camera.y - (py - size.height / 2) / camera.scale];
}

export function toScreen(camera: Camera, size: Size, [x, y]: Point): Point {
  return [size.width / 2 + (x - camera.x) * camera.scale, size.height / 2 - (y - camera.y) * camera.scale];
}

/** The box as large as a picture of a size has room for it. */
export function cameraOn(box: Box, { width, height }: Size): Camera {
  const scale = Math.min(width / (box.right - box.left), height / (box.top - box.bottom));
  return { x: (box.left + box.right) / 2, y: (box.bottom + box.top) / 2, scale };
}

/** The box around points; null around none. */
export function boxAround(x: ArrayLike<number>, y: ArrayLike<number>): Box | null {
  if (x.length === 0) return null;
  const box = { left: Infinity, bottom: Infinity, right: -Infinity, top: -Infinity };
  for (let k = 0; k < x.length; k++) {
    box.left = Math.min(box.left, x[k]!);
    box.right = Math.max(box.right, x[k]!);
    box.bottom = Math.min(box.bottom, y[k]!);
    box.top = Math.max(box.top, y[k]!);
  }
  return box;
}

/** The box around points; null around none. */
export const boxOfPoints = (points: readonly (readonly number[])[]): Box | null => boxAround(points.map(([x]) => x!), points.map(([, y]) => y!));

/** The box with so much air around it. */
export const grown = (box: Box, by: number): Box => ({ left: box.left - by, bottom: box.bottom - by, right: box.right + by, top: box.top + by });

/** The box around boxes; null around none. */
export const around = (boxes: readonly Box[]): Box | null =>
  boxOfPoints(boxes.flatMap(({ left, bottom, right, top }) => [[left, bottom], [right, top]]));

/** How short a car is painted at least, in pixels, where there are so many. */
export const shortestPx = (cars: number): number => (cars <= FEW_CARS ? SHORTEST_PX : LEAST_PX);

/** The box around the mat; null for an unbounded plane. */
export function boxOfMat({ size_m }: Mat): Box | null {
  return size_m ? { left: 0, bottom: 0, right: size_m[0], top: size_m[1] } : null;
}

/** The box around a zone of a mission. */
export function boxOfZone({ corners_m, centre_m, radius_m }: MissionZone): Box {
  if (centre_m) return grown({ left: centre_m[0]!, right: centre_m[0]!, bottom: centre_m[1]!, top: centre_m[1]! }, radius_m!);
  return boxOfPoints(corners_m)!;
}
