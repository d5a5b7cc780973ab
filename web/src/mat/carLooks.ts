/** How the looks of cars change with each picture: colours by their words, lights, wheels that turn, signs of lost messages, dances. */

import type { Picture } from "../api/world";
import { RADIUS_M } from "./camera";
import { type CarLook, carAt, LEADER_SIZE, MOST_RICH } from "./carLook";
import { LEDS, carColour, hexColour, type WordColours } from "./colours";
import { DARK, LAMPS, type LossSign } from "./carPaint";
import { type DanceMove, poseAt } from "./dance";
import type { Point } from "./document";
import { type Drawn, shortestTurn } from "./motion";
import { area, lifted, line, type Mark, rectangle, standing } from "./shapes";
import { TURNS } from "./sprites";
import { ringOf } from "./ways";

const LOSS_SHOWN_MS = 500;
const BLINK_MS = 180;
/** Of the tread of a wheel, in half cars; wheels are that far from the middle of the car. */
const TREAD = 0.195;
const TRACK = 0.68;
/** A car that was moved by hand rolls on no wheel. */
const MOST_ROLLED = 2;

/** What is remembered of a car from one drawing to the next. */
interface Memory {
  blinksUntil: number;
  lostAt: number;
  sign: LossSign;
  /** How far each wheel has turned, in treads. */
  turned: [left: number, right: number];
  last: { x: number; y: number; heading: number } | null;
}

export class CarLooks {
  leads: ReadonlySet<number> = new Set();
  looks: CarLook[] = [];
  private memories: Memory[] = [];
  private halfM = RADIUS_M;
  private dance: { leader: readonly DanceMove[]; followers: readonly DanceMove[]; sinceMs: number } | null = null;

  setCars(cars: number, leads: ReadonlySet<number>, radiusM: number): void {
    this.halfM = radiusM;
    this.leads = leads;
    this.looks = Array.from({ length: cars }, (_, k) => ({ ...carAt(0, 0, 0, leads.has(k), "#c4c4c4"), number: leads.has(k) ? null : k }));
    this.memories = this.looks.map(() => ({ blinksUntil: -Infinity, lostAt: -Infinity, sign: "missed", turned: [0, 0], last: null }));
  }

  /** A frame was lost at this car. */
  lose(car: number, collided: boolean, atMs: number): void {
    const memory = this.memories[car];
    if (!memory) return;
    memory.sign = collided ? "collision" : "missed";
    memory.lostAt = atMs;
  }

  /** A frame was heard by this car: it blinks. */
  hear(car: number, atMs: number): void {
    const memory = this.memories[car];
    if (memory) memory.blinksUntil = atMs + BLINK_MS;
  }

  /** Write beside cars what they count; nothing beside the others. */
  write(texts: ReadonlyMap<number, string>): void {
    this.looks.forEach((look, k) => (look.counts = texts.get(k)));
  }

  /** Let the cars dance from now on. */
  celebrate(leader: readonly DanceMove[], followers: readonly DanceMove[], atMs: number): void {
    this.dance = { leader, followers, sinceMs: atMs };
  }

  /** Take colours and lights from a picture. */
  take(picture: Picture, colours: WordColours): void {
    this.looks.forEach((look, k) => {
      if (k >= picture.cars) return;
      const led = picture.led[k]!;
      look.colour = hexColour(carColour(colours, picture.index[k]!, picture.flags[k]!));
      look.led = led;
      look.light = LEDS[led] === undefined ? null : hexColour(LEDS[led]);
    });
  }

  /** Bring all looks to a moment; true while a later one would differ though no car moves. `still`: no wheel turns. */
  advance(drawn: Drawn, atMs: number, still: boolean): boolean {
    let lasts = false;
    const isMany = this.looks.length > MOST_RICH;
    for (const [k, look] of this.looks.entries()) {
      const memory = this.memories[k]!;
      const heading = drawn.heading[k] ?? 0;
      const moves = look.leads ? this.dance?.leader : this.dance?.followers;
      const pose = this.dance && moves ? poseAt(moves, atMs - this.dance.sinceMs) : null;
      const ahead = (pose?.ahead ?? 0) * this.halfM;
      look.x = (drawn.x[k] ?? 0) + ahead * Math.cos(heading);
      look.y = (drawn.y[k] ?? 0) + ahead * Math.sin(heading);
      look.heading = heading + (pose?.turn ?? 0);
      look.size = (look.leads ? LEADER_SIZE : 1) * (1 + (pose?.lift ?? 0));
      look.blinks = atMs < memory.blinksUntil;
      const age = (atMs - memory.lostAt) / LOSS_SHOWN_MS;
      look.loss = age < 1 ? { sign: memory.sign, alpha: Math.min(1, 2 - 2 * age) } : null;
      if (!still && !isMany) this.turnWheels(look, memory);
      lasts ||= pose !== null || look.blinks || look.loss !== null;
    }
    if (!lasts) this.dance = null;
    return lasts;
  }

  /** Turn each wheel as far as it has rolled since the last drawing. */
  private turnWheels(look: CarLook, memory: Memory): void {
    const { last, turned } = memory;
    const { x, y, heading } = look;
    memory.last = { x, y, heading };
    if (!last) return;
    const half = this.halfM * look.size;
    const ahead = ((x - last.x) * Math.cos(heading) + (y - last.y) * Math.sin(heading)) / half;
    if (Math.abs(ahead) > MOST_ROLLED) return;
    const around = shortestTurn(heading - last.heading) * TRACK;
    turned[0] += (ahead - around) / TREAD;
    turned[1] += (ahead + around) / TREAD;
    look.wheels = [turnOf(turned[0]), turnOf(turned[1])];
  }
}

const turnOf = (treads: number): number => Math.floor((treads - Math.floor(treads)) * TURNS);

/** The bodies as they look from above, in half cars, counter-clockwise. */
const FOLLOWER: readonly Point[] = [[-0.92, -0.5], [-0.78, -0.64], [0.6, -0.64], [0.92, -0.3], [0.92, 0.3], [0.6, 0.64], [-0.78, 0.64], [-0.92, 0.5]];
const LEADER: readonly Point[] = [[-0.94, -0.5], [-0.78, -0.68], [0.4, -0.68], [0.86, -0.4], [1, 0], [0.86, 0.4], [0.4, 0.68], [-0.78, 0.68], [-0.94, 0.5]];

/**
 * The marks of a car that is `half` a car long to its front: its body, what is beyond the body, and what is before it,
 * as seen from behind, or else from its front.
 */
export function carMarks(car: CarLook, half: number, fromBehind: boolean, contrast: boolean): { far: Mark[]; body: Mark[]; near: Mark[] } {
  const [cos, sin] = [Math.cos(car.heading) * half, Math.sin(car.heading) * half];
  const at = ([ahead, aside]: Point): Point => [car.x + ahead * cos - aside * sin, car.y + ahead * sin + aside * cos];
  const ball = (place: Point, high: number, wide: number, colour: string, alpha = 1): Mark =>
    lifted(line([at(place)], wide * half, colour, alpha), high * half);
  const wheels = [0.72, -0.72].map((side) => area(rectangle(-0.66, side - 0.16, 0.54, side + 0.16).map(at), DARK));
  const outline = (car.leads ? LEADER : FOLLOWER).map(at);
  const eyes = [0.25, -0.25].flatMap((aside) => [ball([0.9, aside], 0.55, 0.42, "#ffffff"), ball([0.93, aside], 0.55, 0.2, "#7a1030")]);
  const tails = [0.42, -0.42].map((aside) => ball([-0.94, aside], 0.5, 0.24, "#ff3b30"));
  const lamps = LAMPS.flatMap((lamp, k) => {
    if (k !== car.led || !car.light) return [ball(lamp, 0.82, 0.26, DARK), ball(lamp, 0.82, 0.19, "#dfe5ee")];
    return [ball(lamp, 0.82, 1.8, car.light, 0.25), ball(lamp, 0.82, 1.1, car.light, 0.25), ball(lamp, 0.82, 0.34, car.light)];
  });
  const pole = standing(area(ringOf(at([-0.36, 0]), 0.06 * half, 6), DARK), 1.45 * half, 0.78 * half);
  const beacon = car.leads ? [pole, ball([-0.36, 0], 1.6, 0.5, "#ffffff"), ball([-0.36, 0], 1.6, 0.4, "#d62728")] : [];
  const body = [
    area(ringOf([car.x, car.y], half * 1.1), "#000000", contrast ? 0 : 0.22),
    ...wheels.map((wheel) => standing(wheel, 0.5 * half)),
    standing(area(outline, car.colour), 0.78 * half, 0.24 * half),
    ...lamps,
    ...beacon,
  ];
  return fromBehind ? { far: eyes, body, near: tails } : { far: tails, body, near: eyes };
}
