/** The marks of which pictures of a mat are made, and the shapes that many of them share. Lengths are metres. */

import type { Point } from "./document";
import { closedWay, ringOf } from "./ways";

/** An area where `widthM` is 0, else a line of that width along a way; a line of one point is a ball. */
export interface Mark {
  way: readonly Point[];
  widthM: number;
  colour: string;
  /** 1 where it isn't given. */
  alpha?: number;
  /** A line is at least so many pixels wide. */
  leastPx?: number;
  /** From where to where it stands above the floor; it lies at `highM` where both are the same. */
  lowM?: number;
  highM?: number;
  /** The colour of windows on its sides. */
  panes?: string;
}

/** What stands on the floor: its outline there, or both ends of a wall, and its marks from the lowest to the highest. */
export interface Thing {
  footprint: readonly Point[];
  marks: readonly Mark[];
}

const CORNERS = 28;
/** Of a rim, which is 2 pixels wide. */
const HAIR_M = 0.001;

export const rectangle = (left: number, bottom: number, right: number, top: number): Point[] => [[left, bottom], [right, bottom], [right, top], [left, top]];

export const area = (way: readonly Point[], colour: string, alpha = 1): Mark => ({ way, widthM: 0, colour, alpha });

export const line = (way: readonly Point[], widthM: number, colour: string, alpha = 1): Mark => ({ way, widthM, colour, alpha });

export const disc = ([x, y]: Point, radius: number, colour: string, alpha = 1): Mark => area(ringOf([x, y], radius, CORNERS), colour, alpha);

/** The closed outline of an area. */
export const rim = (way: readonly Point[], colour: string, widthM = HAIR_M, alpha = 1): Mark => ({ way: closedWay(way), widthM, colour, alpha, leastPx: 2 });

/** The same mark, from so far above the floor to so far. */
export const standing = (mark: Mark, highM: number, lowM = 0): Mark => ({ ...mark, highM, lowM });

/** The same mark, lying so far above the floor. */
export const lifted = (mark: Mark, highM: number): Mark => standing(mark, highM, highM);

function middleOf(corners: readonly Point[]): Point {
  let [x, y] = [0, 0];
  for (const corner of corners) [x, y] = [x + corner[0], y + corner[1]];
  return [x / corners.length, y / corners.length];
}

/** An outline, nearer to its middle. */
export function shrunk(corners: readonly Point[], share: number): Point[] {
  const [x, y] = middleOf(corners);
  return corners.map(([cx, cy]) => [x + (cx - x) * share, y + (cy - y) * share]);
}

/** A rectangle around a point: so far along a direction, and so far across. */
export function plank([x, y]: Point, angle: number, half: number, wide: number): Point[] {
  const [cos, sin] = [Math.cos(angle), Math.sin(angle)];
  const corner = (along: number, across: number): Point => [x + along * cos - across * sin, y + along * sin + across * cos];
  return [corner(-half, -wide), corner(half, -wide), corner(half, wide), corner(-half, wide)];
}
