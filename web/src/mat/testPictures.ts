/** Pictures for tests. */

import { Flag, NO_INDEX, type Picture } from "../api/world";

export interface DrawnCar {
  x?: number;
  y?: number;
  heading?: number;
  index?: number;
  wheels?: number;
  led?: number;
  flags?: number;
}

export function pictureOf(cars: readonly DrawnCar[], more: Partial<Picture> = {}): Picture {
  return {
    frame: 1,
    tMs: 0,
    past: false,
    fresh: false,
    cars: cars.length,
    lost: 0,
    x: Float32Array.from(cars, (car) => car.x ?? 0),
    y: Float32Array.from(cars, (car) => car.y ?? 0),
    heading: Float32Array.from(cars, (car) => car.heading ?? 0),
    index: Uint16Array.from(cars, (car) => car.index ?? NO_INDEX),
    wheels: Uint8Array.from(cars, (car) => car.wheels ?? 0),
    led: Uint8Array.from(cars, (car) => car.led ?? 4),
    flags: Uint8Array.from(cars, (car) => car.flags ?? Flag.runs),
    events: new Uint32Array(),
    ...more,
  };
}
