/** What a camera behind a car sees: points of the world, in metres, as pixels of a picture. */

import type { Size } from "./camera";
import { ringOf } from "./ways";

/** Where the camera is and looks: along `heading`, level, `highM` above the floor. */
export interface Eye {
  x: number;
  y: number;
  heading: number;
  highM: number;
}

/** How the picture is taken: a point 1 m ahead and 1 m aside is `focus` pixels from the middle. */
export interface Lens {
  middle: number;
  horizon: number;
  focus: number;
}

const BEHIND_M = 0.62;
const HIGH_M = 0.4;
/** What is nearer than this is behind the picture. */
const NEAR_M = 0.06;

export function lensOf({ width, height }: Size): Lens {
  return { middle: width / 2, horizon: height * 0.32, focus: Math.min(width * 0.8, height * 0.8) };
}

/** Behind and above a car that looks along `heading`. */
export function eyeBehind(x: number, y: number, heading: number): Eye {
  return { x: x - BEHIND_M * Math.cos(heading), y: y - BEHIND_M * Math.sin(heading), heading, highM: HIGH_M };
}

/** The car that the eye is behind. */
export function carBefore({ x, y, heading }: Eye): [number, number] {
  return [x + BEHIND_M * Math.cos(heading), y + BEHIND_M * Math.sin(heading)];
}

/** How far ahead of the eye a point of the floor is, in metres; negative behind it. */
export function aheadOf(eye: Eye, x: number, y: number): number {
  return (x - eye.x) * Math.cos(eye.heading) + (y - eye.y) * Math.sin(eye.heading);
}

/** How many pixels a metre takes at a point; 0 where it is not seen. */
export function scaleAt(eye: Eye, lens: Lens, x: number, y: number): number {
  const ahead = aheadOf(eye, x, y);
  return ahead > NEAR_M ? lens.focus / ahead : 0;
}

/**
 * A polygon as the camera sees it. `corners` holds x, y and z of each corner; the answer x and y of each corner in the
 * picture. What is behind the camera is cut off: the answer is empty where nothing is left.
 */
export function seen(eye: Eye, lens: Lens, corners: readonly number[], closed = true): number[] {
  const [cos, sin] = [Math.cos(eye.heading), Math.sin(eye.heading)];
  const picture: number[] = [];
  const put = (ahead: number, aside: number, z: number) => {
    const scale = lens.focus / ahead;
    picture.push(lens.middle - aside * scale, lens.horizon + (eye.highM - z) * scale);
  };
  let [ahead0, aside0, z0] = [0, 0, 0];
  const count = corners.length / 3;
  for (let k = closed ? -1 : 0; k < count; k++) {
    const at = 3 * (k < 0 ? count - 1 : k);
    const [dx, dy, z] = [corners[at]! - eye.x, corners[at + 1]! - eye.y, corners[at + 2]!];
    const ahead = dx * cos + dy * sin;
    const aside = dy * cos - dx * sin;
    const isFirst = k === (closed ? -1 : 0);
    if (!isFirst && ahead >= NEAR_M !== ahead0 >= NEAR_M) {
      const share = (NEAR_M - ahead0) / (ahead - ahead0);
      put(NEAR_M, aside0 + (aside - aside0) * share, z0 + (z - z0) * share);
    }
    if (ahead >= NEAR_M && (!isFirst || !closed)) put(ahead, aside, z);
    [ahead0, aside0, z0] = [ahead, aside, z];
  }
  return picture;
}

/** The corners of a circle on the floor, as x, y and 0. */
export function circleAt(x: number, y: number, radius: number): number[] {
  return ringOf([x, y], radius).flatMap((corner) => [...corner, 0]);
}
