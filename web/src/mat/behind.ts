/**
 * Paints a view as it is seen from behind a car: the same marks, extruded from `lowM` to `highM`. Sky and floor come
 * first, then things, people and cars, from the farthest to the nearest; what would hide the car is seen through.
 * Lengths are metres; an eye looks along its heading, level, HIGH_M above the floor.
 */

import type { Ring } from "./air";
import type { Size } from "./camera";
import { carMarks } from "./carLooks";
import type { CarLook } from "./carLook";
import { DARK, dot } from "./carPaint";
import { pageFont, plateColour } from "./colours";
import { listOf, personAt, type Point } from "./document";
import { figure } from "./figure";
import { skyOver } from "./floors";
import { marksOf } from "./marks";
import type { View } from "./painter";
import { area, type Mark, rim, type Thing } from "./shapes";
import { bandAlong, chordsOf, closedWay, crosses, distance, pointBetween, ringOf, turnOf } from "./ways";
import { zoneMarks } from "./zones";

export interface Eye {
  x: number;
  y: number;
  heading: number;
}

/** What is painted at a distance; `footprint` where it can hide something. */
export interface Solid {
  at: Point;
  footprint: readonly Point[] | null;
  paint: () => void;
}

type Corner = readonly [x: number, y: number, z: number];
type Pixel = [x: number, y: number];

/** A canvas of a size, in pixels of the page, and the eye that looks at it. */
interface Lens {
  g: CanvasRenderingContext2D;
  eye: Eye;
  size: Size;
  contrast: boolean;
}

const BEHIND_M = 0.62;
const HIGH_M = 0.4;
/** What is nearer than this is behind the picture. */
const NEAR_M = 0.06;
const NEAREST_CAR_M = 0.1;
const FARTHEST_M = 14;
const MOST_CARS = 250;
/** Of what would hide the car that is looked after. */
const SHEER = 0.22;
/** This far the line of sight goes on behind a car, as a share of its length. */
const BEYOND = 20;
/** A line that is thinner has the same width wherever it lies. */
const WIDEST_HAIR_M = 0.004;
const PERSON_M = 0.62;
const STEP_MS = 400;
const NUMBERED_PX = 23;
const PANE_M = 0.13;

/** The point so far ahead of an eye, or of a car. */
const pointAhead = ({ x, y, heading }: Eye, metres: number): Point => [x + metres * Math.cos(heading), y + metres * Math.sin(heading)];

/** Behind and above a car that looks along `heading`. */
export function eyeBehind(x: number, y: number, heading: number): Eye {
  const [eyeX, eyeY] = pointAhead({ x, y, heading }, -BEHIND_M);
  return { x: eyeX, y: eyeY, heading };
}

/** A way, so far above the floor. */
const raised = (way: readonly Point[], z: number): Corner[] => way.map(([x, y]) => [x, y, z]);

/** How far ahead of the eye a point of the floor is; negative behind it. */
const aheadOf = (eye: Eye, [x, y]: Point): number => (x - eye.x) * Math.cos(eye.heading) + (y - eye.y) * Math.sin(eye.heading);

const asideOf = (eye: Eye, [x, y]: Point): number => (y - eye.y) * Math.cos(eye.heading) - (x - eye.x) * Math.sin(eye.heading);

const horizonOf = ({ height }: Size): number => height * 0.32;

/** How many pixels 1 m has at a distance of 1 m. */
const focusOf = ({ width, height }: Size): number => Math.min(width, height) * 0.8;

const pixelsAt = ({ eye, size }: Lens, at: Point): number => (aheadOf(eye, at) > NEAR_M ? focusOf(size) / aheadOf(eye, at) : 0);

/** An outline at heights as the eye sees it, cut off where it reaches behind it; empty where nothing is left. */
export function seen(eye: Eye, size: Size, corners: readonly Corner[], closed = true): Pixel[] {
  const turned = corners.map(([x, y, z]) => ({ ahead: aheadOf(eye, [x, y]), aside: asideOf(eye, [x, y]), z }));
  return turned.flatMap((here, k) => {
    const before = turned[k - 1] ?? (closed ? turned.at(-1)! : here);
    const points = here.ahead >= NEAR_M ? [here] : [];
    if (here.ahead >= NEAR_M !== before.ahead >= NEAR_M) {
      const share = (NEAR_M - before.ahead) / (here.ahead - before.ahead);
      const [aside, z] = pointBetween([before.aside, before.z], [here.aside, here.z], share);
      points.unshift({ ahead: NEAR_M, aside, z });
    }
    return points.map(({ ahead, aside, z }): Pixel => {
      const scale = focusOf(size) / ahead;
      return [size.width / 2 - aside * scale, horizonOf(size) + (HIGH_M - z) * scale];
    });
  });
}

/** All that is painted, the farthest first. A wall's middle says too little of a car beside it: the car comes before all that hides it. */
export function paintOrder(eye: Eye, solids: readonly Solid[]): Solid[] {
  const from: Point = [eye.x, eye.y];
  const placed = solids.map((solid) => {
    const ahead = aheadOf(eye, solid.at);
    const { at, footprint } = solid;
    if (footprint) return { solid, ahead };
    const beyond = pointBetween(from, at, 1 + BEYOND);
    let [most, least] = [ahead, 0];
    for (const other of solids) {
      if (!other.footprint) continue;
      const otherAhead = aheadOf(eye, other.at);
      const reach = Math.max(...other.footprint.map((corner) => distance(corner, other.at)));
      // All of it is nearer than the car, or all of it is farther.
      if (Math.abs(otherAhead - ahead) > reach) continue;
      if (crosses(other.footprint, from, at)) least = Math.max(least, otherAhead + 1e-6);
      else if (crosses(other.footprint, at, beyond)) most = Math.min(most, otherAhead - 1e-6);
    }
    return { solid, ahead: Math.max(most, least) };
  });
  return placed.sort((a, b) => b.ahead - a.ahead).map(({ solid }) => solid);
}

/** Paint the view from an eye on a canvas of a size, in pixels of the page. */
export function paintBehind(g: CanvasRenderingContext2D, view: View, eye: Eye, size: Size): void {
  const { mat, floor, theme, contrast } = view;
  const lens: Lens = { g, eye, size, contrast };
  paintSky(lens, view);
  const marks = mat && marksOf(mat, floor, theme);
  if (marks) paintMarks(lens, [...marks.ground, ...marks.pattern, ...marks.flat]);
  for (const zone of view.zones) paintMarks(lens, zoneMarks(zone, theme, contrast));
  for (const ring of view.rings) paintRing(lens, ring);
  const things = marks?.things.map((thing) => solidOf(lens, thing)) ?? [];
  for (const { paint } of paintOrder(eye, [...things, ...peopleOf(lens, view), ...carsOf(lens, view)])) paint();
}

function paintSky({ g, size: { width, height }, contrast }: Lens, { floor, theme }: View): void {
  const horizon = horizonOf({ width, height });
  const sky = g.createLinearGradient(0, 0, 0, horizon);
  skyOver(floor, theme).forEach((colour, k) => sky.addColorStop(k, colour));
  g.fillStyle = theme.ground;
  g.fillRect(0, horizon, width, height - horizon);
  g.fillStyle = sky;
  g.fillRect(0, 0, width, horizon);
  g.fillStyle = contrast ? "#ffffff" : theme.edge;
  g.fillRect(0, horizon - 1, width, 1.5);
}

/** Paint with a share of the alpha that the canvas has. */
function paintSheer(g: CanvasRenderingContext2D, alpha: number, paint: () => void): void {
  const before = g.globalAlpha;
  g.globalAlpha = before * alpha;
  paint();
  g.globalAlpha = before;
}

const paintMarks = (lens: Lens, marks: readonly Mark[]): void => marks.forEach((mark) => paintMark(lens, mark));

function paintMark(lens: Lens, mark: Mark): void {
  const { way, widthM, highM = 0, lowM = 0 } = mark;
  if (way.length === 1) paintBall(lens, mark);
  else if (widthM > 0 && widthM < WIDEST_HAIR_M) paintHair(lens, mark);
  else {
    const outline = widthM ? bandAlong(way, widthM) : way;
    const edge = lens.contrast ? "#ffffff" : "rgba(20,26,40,0.35)";
    const stands = highM > lowM;
    if (stands) paintSides(lens, outline, mark, edge);
    if (highM < HIGH_M) fill(lens.g, seen(lens.eye, lens.size, raised(outline, highM)), mark.colour, mark.alpha, stands ? edge : "");
  }
}

function paintBall(lens: Lens, { way: [at], widthM, highM = 0, colour, alpha = 1 }: Mark): void {
  const [middle] = seen(lens.eye, lens.size, raised([at!], highM), false);
  if (middle) paintSheer(lens.g, alpha, () => dot(lens.g, colour, ...middle, (widthM / 2) * pixelsAt(lens, at!)));
}

function paintHair({ g, eye, size }: Lens, { way, highM = 0, colour, leastPx = 1 }: Mark): void {
  g.beginPath();
  for (const point of seen(eye, size, raised(way, highM), false)) g.lineTo(...point);
  g.strokeStyle = colour;
  g.lineWidth = leastPx;
  g.stroke();
}

/** Paint the sides of a prism that look this way, darker the more they look aside, with its windows. */
function paintSides({ g, eye, size }: Lens, outline: readonly Point[], { colour, lowM = 0, highM = 0, panes }: Mark, edge: string): void {
  const upright = (a: Point, b: Point, low: number, high: number) => seen(eye, size, [...raised([a, b], low), ...raised([b, a], high)]);
  const chords = chordsOf(closedWay(outline));
  const isLeft = chords.reduce((sum, [a, b]) => sum + turnOf([0, 0], a, b), 0) > 0;
  for (const [a, b] of chords) {
    if (turnOf(a, b, [eye.x, eye.y]) > 0 === isLeft) continue;
    const across = Math.abs(Math.sin(Math.atan2(b[1] - a[1], b[0] - a[0]) - eye.heading));
    fill(g, upright(a, b, lowM, highM), colour, 1, edge);
    fill(g, upright(a, b, lowM, highM), "#000000", 0.38 - 0.16 * across);
    const count = panes ? Math.min(6, Math.floor(distance(a, b) / PANE_M)) : 0;
    for (let pane = 0; pane < count; pane++) {
      const [left, right] = [0.25, 0.75].map((share) => pointBetween(a, b, (pane + share) / count));
      fill(g, upright(left!, right!, 0.12, 0.21), panes!);
    }
  }
}

function fill(g: CanvasRenderingContext2D, corners: readonly Pixel[], colour: string, alpha = 1, edge = ""): void {
  if (corners.length < 3) return;
  g.beginPath();
  for (const corner of corners) g.lineTo(...corner);
  g.closePath();
  g.fillStyle = colour;
  paintSheer(g, alpha, () => g.fill());
  g.strokeStyle = edge;
  g.lineWidth = 1;
  if (edge) g.stroke();
}

function paintRing(lens: Lens, { x, y, radiusM, widthPx, colour, alpha, fill: inside }: Ring): void {
  const ring = ringOf([x, y], radiusM);
  paintMark(lens, area(ring, colour, inside));
  paintSheer(lens.g, alpha, () => paintMark(lens, { ...rim(ring, colour), leastPx: widthPx }));
}

/** A thing, which is seen through where it would hide the car that is looked after. */
function solidOf(lens: Lens, { footprint, marks }: Thing): Solid {
  const { g, eye } = lens;
  const hides = crosses(footprint, [eye.x, eye.y], pointAhead(eye, BEHIND_M));
  const paint = () => paintSheer(g, hides ? SHEER : 1, () => paintMarks(lens, marks));
  return { at: pointBetween(footprint[0]!, footprint.at(-1)!, 0.5), footprint, paint };
}

function peopleOf(lens: Lens, { mat, theme, tMs }: View): Solid[] {
  const { g, eye, size } = lens;
  return (mat ? listOf(mat, "person") : []).map((person) => {
    const at = personAt(person, tMs);
    const paint = () => {
      const [foot] = seen(eye, size, raised([at], 0), false);
      if (!foot) return;
      const high = PERSON_M * pixelsAt(lens, at);
      g.save();
      g.translate(...foot);
      g.scale(high, high);
      figure(g, theme.person, (tMs / STEP_MS) % 1);
      g.restore();
    };
    return { at, footprint: null, paint };
  });
}

/** The cars that can be seen, at most MOST_CARS of them. */
function carsOf(lens: Lens, { cars, carM }: View): Solid[] {
  const placed = cars.map((car, number) => ({ car, number, at: [car.x, car.y] as const, ahead: aheadOf(lens.eye, [car.x, car.y]) }));
  const seenCars = placed.filter(({ ahead }) => ahead > NEAREST_CAR_M && ahead < FARTHEST_M).sort((a, b) => a.ahead - b.ahead);
  return seenCars.slice(0, MOST_CARS).map(({ car, number, at }) => ({ at, footprint: null, paint: () => paintCar(lens, car, number, (carM / 2) * car.size) }));
}

function paintCar(lens: Lens, car: CarLook, number: number, half: number): void {
  const isAway = Math.cos(car.heading - lens.eye.heading) > 0;
  const { far, body, near } = carMarks(car, half, isAway, lens.contrast);
  paintMarks(lens, [...far, ...body, ...near]);
  const px = half * pixelsAt(lens, [car.x, car.y]);
  const [rear] = seen(lens.eye, lens.size, raised([pointAhead(car, -0.94 * half)], 0.5 * half), false);
  if (isAway && rear && px >= NUMBERED_PX) paintPlate(lens.g, rear, px, number);
}

function paintPlate(g: CanvasRenderingContext2D, at: Pixel, px: number, number: number): void {
  dot(g, plateColour(number), ...at, 0.3 * px);
  g.font = `700 ${Math.round(px * 0.42)}px ${pageFont()}`;
  g.textAlign = "center";
  g.textBaseline = "middle";
  g.fillStyle = DARK;
  g.fillText(String(number), ...at);
}
