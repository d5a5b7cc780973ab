/** What a car looks like at a moment: where it is painted, in which colours, with which lights and signs. */

import { NO_LED } from "../api/world";
import { LEDS, hexColour } from "./colours";
import type { LossSign } from "./carPaint";

/** More cars than these are painted as simple sprites: without wheels, face and plate. */
export const MOST_RICH = 200;

/** A car as it is painted; lengths are metres. */
export interface CarLook {
  x: number;
  y: number;
  /** Radians. */
  heading: number;
  colour: string;
  leads: boolean;
  /** How large it is, compared with the others. */
  size: number;
  /** The number of the light that is on, and its colour; null for none. */
  led: number;
  light: string | null;
  blinks: boolean;
  /** The picture of each wheel's turn. */
  wheels: readonly [left: number, right: number];
  loss: { sign: LossSign; alpha: number } | null;
  /** What stands on its plate, or null for none. */
  number: number | null;
  /** What is written above it. */
  name?: string;
  /** What it counts, written below it. */
  counts?: string;
  sends: boolean;
}

export const LEADER_SIZE = 1.15;

/** A car that stands and does nothing. */
export const carAt = (x: number, y: number, heading: number, leads: boolean, colour: string, led: number = NO_LED): CarLook => ({
  x,
  y,
  heading,
  colour,
  leads,
  size: leads ? LEADER_SIZE : 1,
  led,
  light: LEDS[led] === undefined ? null : hexColour(LEDS[led]),
  blinks: false,
  wheels: [0, 0],
  loss: null,
  number: null,
  sends: false,
});
