/**
 * Paints one car, put together of sprites that are painted once.
 */

import type { CarLook } from "./carLook";
import { LAMPS } from "./carPaint";
import { plateColour } from "./colours";
import { bodySprite, glowSprite, ledSprite, plateSprite, shadowSprite, wheelSprite } from "./sprites";

/** A car has a number plate where its number, or at least its colour, can be told. */
const PLATE_PX = 26;

/** A car on the canvas: its middle, and half its length, in pixels of the device. */
export interface SeenCar {
  car: CarLook;
  k: number;
  x: number;
  y: number;
  half: number;
  cos: number;
  sin: number;
}

/** From now on, coordinates are so many pixels ahead of the middle of a car and to its right. */
function inCar(g: CanvasRenderingContext2D, { x, y, cos, sin }: SeenCar): void {
  g.setTransform(cos, -sin, sin, cos, x, y);
}

/** Put a sprite around a point of the car, which is given in half cars ahead and to the left; so is its side. */
function put(g: CanvasRenderingContext2D, sprite: HTMLCanvasElement, half: number, ahead: number, aside: number, sides: number): void {
  const side = sides * half;
  g.drawImage(sprite, ahead * half - side / 2, -aside * half - side / 2, side, side);
}

/** The body that each car had last: of a thousand cars, few change between two pictures. */
const bodies = new WeakMap<CarLook, { colour: string; blinks: boolean; kind: number; side: number; sprite: HTMLCanvasElement }>();

function bodyOf(car: CarLook, simple: boolean, contrast: boolean, side: number): HTMLCanvasElement {
  const last = bodies.get(car);
  const kind = Number(simple) + 2 * Number(contrast);
  if (last?.colour === car.colour && last.blinks === car.blinks && last.kind === kind && last.side === side) return last.sprite;
  const sprite = bodySprite(car, simple, contrast, side);
  bodies.set(car, { colour: car.colour, blinks: car.blinks, kind, side, sprite });
  return sprite;
}

/** Paint a car's shadow, and its light on the floor. */
export function paintUnder(g: CanvasRenderingContext2D, at: SeenCar): void {
  const { car, half } = at;
  inCar(g, at);
  put(g, shadowSprite(2.5 * half), half, -0.06, -0.1, 2.5);
  const lamp = LAMPS[car.led];
  if (lamp && car.light) put(g, glowSprite(car.light, 3.4 * half), half, lamp[0], lamp[1], 3.4);
}

/** Paint a car's wheels, body, plate and LED. */
export function paintBody(g: CanvasRenderingContext2D, at: SeenCar, simple: boolean, contrast: boolean, sharpness: number): void {
  const { car, half, k } = at;
  inCar(g, at);
  const rich = !simple && !contrast;
  if (rich) {
    put(g, wheelSprite(car.wheels[0], 0.78 * half), half, -0.06, 0.68, 0.78);
    put(g, wheelSprite(car.wheels[1], 0.78 * half), half, -0.06, -0.68, 0.78);
  }
  put(g, bodyOf(car, simple, contrast, 2 * half), half, 0, 0, 2);
  if (!simple && car.number !== null && 2 * half >= PLATE_PX * sharpness) {
    put(g, plateSprite(car.number, contrast ? "#ffffff" : plateColour(k), 0.62 * half), half, -0.34, 0, 0.62);
  }
  if (!car.light) return;
  const lamp = LAMPS[car.led];
  if (simple || !lamp) put(g, ledSprite(car.light, 1.24 * half), half, -0.72, 0, 1.24);
  else put(g, ledSprite(car.light, 0.88 * half), half, lamp[0], lamp[1], 0.88);
}

