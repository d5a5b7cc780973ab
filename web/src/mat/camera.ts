/** What part of the plane is seen: the point in the middle, in metres, and how many pixels a metre takes. */

import type { Mat, Point } from "./document";
import { FURNITURE, handlesOf, listOf } from "./document";

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

const LEAST_SCALE = 0.2;
const MOST_SCALE = 3000;
const MARGIN_PX = 20;
/** The buttons at the right edge. */
const BUTTONS_PX = 48;

export function toWorld(camera: Camera, size: Size, px: number, py: number): Point {
  return [camera.x + (px - size.width / 2) / camera.scale, camera.y - (py - size.height / 2) / camera.scale];
}

export function toScreen(camera: Camera, size: Size, [x, y]: Point): Point {
  return [size.width / 2 + (x - camera.x) * camera.scale, size.height / 2 - (y - camera.y) * camera.scale];
}

/** The point under the pointer stays under it. */
export function zoomed(camera: Camera, size: Size, factor: number, px = size.width / 2, py = size.height / 2): Camera {
  const scale = Math.min(MOST_SCALE, Math.max(LEAST_SCALE, camera.scale * factor));
  const [x, y] = toWorld(camera, size, px, py);
  const share = camera.scale / scale;
  return { x: x + (camera.x - x) * share, y: y + (camera.y - y) * share, scale };
}

export function panned(camera: Camera, dxPx: number, dyPx: number): Camera {
  return { ...camera, x: camera.x - dxPx / camera.scale, y: camera.y + dyPx / camera.scale };
}

export function fitted(box: Box, size: Size): Camera {
  const width = Math.max(0.5, box.right - box.left);
  const height = Math.max(0.5, box.top - box.bottom);
  const free = (pixels: number) => Math.max(40, pixels - 2 * MARGIN_PX);
  const scale = Math.min(free(size.width - BUTTONS_PX) / width, free(size.height) / height, MOST_SCALE);
  return { x: (box.left + box.right) / 2 + BUTTONS_PX / 2 / scale, y: (box.bottom + box.top) / 2, scale };
}

/** The box around the mat; on an unbounded plane, around all cars and furniture. */
export function boxOf(mat: Mat, x: ArrayLike<number>, y: ArrayLike<number>): Box {
  if (mat.size_m) return { left: 0, bottom: 0, right: mat.size_m[0], top: mat.size_m[1] };
  const points: Point[] = FURNITURE.flatMap((kind) => listOf(mat, kind).flatMap((piece) => handlesOf(kind, piece)));
  for (let k = 0; k < x.length; k++) points.push([x[k]!, y[k]!]);
  const box = { left: Infinity, bottom: Infinity, right: -Infinity, top: -Infinity };
  for (const [px, py] of points) {
    box.left = Math.min(box.left, px);
    box.right = Math.max(box.right, px);
    box.bottom = Math.min(box.bottom, py);
    box.top = Math.max(box.top, py);
  }
  if (points.length === 0) return { left: -2, bottom: -1.5, right: 2, top: 1.5 };
  return { left: box.left - 0.5, bottom: box.bottom - 0.5, right: box.right + 0.5, top: box.top + 0.5 };
}

/** A round length whose bar is about `wishedPx` long. */
export function scaleBar(camera: Camera, wishedPx = 110): { metres: number; pixels: number } {
  const wished = wishedPx / camera.scale;
  const power = 10 ** Math.floor(Math.log10(wished));
  const metres = [5, 2, 1].map((each) => each * power).find((each) => each <= wished * 1.0001) ?? power;
  return { metres, pixels: metres * camera.scale };
}
