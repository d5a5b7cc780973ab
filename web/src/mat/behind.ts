/**
 * Paints a view as it is seen from behind a car: the same marks, extruded from `lowM` to `highM`. Sky and floor come
 * first, then things, people and cars, from the farthest to the nearest; what would hide the car is seen through.
 * Lengths are metres; an eye looks along its heading, level, HIGH_M above the floor.
 */

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
import { area, type Mark, rim } from "./shapes";
import { bandAlong, chordsOf, closedWay, distance, pointBetween, ringOf } from "./ways";
import { zoneMarks } from "./zones";

export interface Eye {
  x: number;
  y: number;
  heading: number;
}

const BEHIND_M = 0.62;
const HIGH_M = 0.4;
/** What is nearer than this is behind the picture. */
const NEAR_M = 0.06;
const FARTHEST_M = 14;
const MOST_CARS = 250;
/** Of what would hide the car that is looked after. */
const SHEER = 0.22;
/** This far the line of sight goes on behind a car, as a share of its length. */
const BEYOND = 20;
const PERSON_M = 0.62;
const NUMBERED_PX = 23;
const PANE_M = 0.13;

/** Behind and above a car that looks along `heading`. */
export const eyeBehind = (x: number, y: number, heading: number): Eye => ({
  x: x - BEHIND_M * Math.cos(heading),
  y: y - BEHIND_M * Math.sin(heading),
  heading,
});

/** How far ahead of the eye a point of the floor is; negative behind it. */
const aheadOf = (eye: Eye, [x, y]: Point): number => (x - eye.x) * Math.cos(eye.heading) + (y - eye.y) * Math.sin(eye.heading);

/** A picture of a size: a point 1 m ahead and 1 m aside is `focus` pixels from its middle. */
const lensOf = ({ width, height }: Size) => ({ middle: width / 2, horizon: height * 0.32, focus: Math.min(width, height) * 0.8 });

/** An outline at heights as the eye sees it, cut off where it reaches behind it; empty where nothing is left. */
export function seen(eye: Eye, size: Size, corners: readonly (readonly [x: number, y: number, z: number])[], closed = true): [number, number][] {
  const { middle, horizon, focus } = lensOf(size);
  const [cos, sin] = [Math.cos(eye.heading), Math.sin(eye.heading)];
  const turned = corners.map(([x, y, z]) => ({ ahead: (x - eye.x) * cos + (y - eye.y) * sin, aside: (y - eye.y) * cos - (x - eye.x) * sin, z }));
  return turned.flatMap((here, k) => {
    const before = turned[k - 1] ?? (closed ? turned.at(-1)! : here);
    const points = here.ahead >= NEAR_M ? [here] : [];
    if (here.ahead >= NEAR_M !== before.ahead >= NEAR_M) {
      const share = (NEAR_M - before.ahead) / (here.ahead - before.ahead);
      points.unshift({ ahead: NEAR_M, aside: before.aside + (here.aside - before.aside) * share, z: before.z + (here.z - before.z) * share });
    }
    return points.map(({ ahead, aside, z }): [number, number] => [middle - (aside * focus) / ahead, horizon + ((HIGH_M - z) * focus) / ahead]);
  });
}

const turn = ([ax, ay]: Point, [bx, by]: Point, [cx, cy]: Point) => (bx - ax) * (cy - ay) - (by - ay) * (cx - ax);

/** How many sides of an outline, or of a wall, a line from a point to another crosses. */
function crossed(footprint: readonly Point[], a: Point, b: Point): number {
  const sides = chordsOf(footprint.length > 2 ? closedWay(footprint) : footprint);
  return sides.filter(([c, d]) => turn(a, b, c) > 0 !== turn(a, b, d) > 0 && turn(c, d, a) > 0 !== turn(c, d, b) > 0).length;
}

/** What is painted at a distance; `footprint` where it can hide something. */
export interface Solid {
  at: Point;
  footprint: readonly Point[] | null;
  paint: () => void;
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
      if (crossed(other.footprint, from, at)) least = Math.max(least, otherAhead + 1e-6);
      else if (crossed(other.footprint, at, beyond)) most = Math.min(most, otherAhead - 1e-6);
    }
    return { solid, ahead: Math.max(most, least) };
  });
  return placed.sort((a, b) => b.ahead - a.ahead).map(({ solid }) => solid);
}

/** Paint the view from an eye on a canvas of a size, in pixels of the page. */
export function paintBehind(g: CanvasRenderingContext2D, view: View, eye: Eye, size: Size): void {
  const { mat, theme, floor, contrast } = view;
  const { horizon, focus } = lensOf(size);
  const chased: Point = [eye.x + BEHIND_M * Math.cos(eye.heading), eye.y + BEHIND_M * Math.sin(eye.heading)];
  const pixelsAt = (at: Point): number => (aheadOf(eye, at) > NEAR_M ? focus / aheadOf(eye, at) : 0);

  const fill = (corners: [number, number][], colour: string, alpha = 1, edge = "") => {
    if (corners.length < 3) return;
    g.beginPath();
    for (const corner of corners) g.lineTo(...corner);
    g.closePath();
    const before = g.globalAlpha;
    g.globalAlpha = before * alpha;
    g.fillStyle = colour;
    g.fill();
    g.globalAlpha = before;
    g.strokeStyle = edge;
    g.lineWidth = 1;
    if (edge) g.stroke();
  };
  const ball = ([x, y]: [number, number], radius: number, colour: string, alpha = 1) => {
    g.globalAlpha *= alpha;
    dot(g, colour, x, y, radius);
    g.globalAlpha /= alpha;
  };
  const upright = ([ax, ay]: Point, [bx, by]: Point, low: number, high: number) =>
    seen(eye, size, [[ax, ay, low], [bx, by, low], [bx, by, high], [ax, ay, high]]);
  const level = (way: readonly Point[], z: number) => seen(eye, size, way.map(([x, y]) => [x, y, z] as const));

  /** The sides of a prism that look this way, darker the more they look aside, with its windows. */
  const sides = (outline: readonly Point[], { colour, lowM = 0, highM = 0, panes }: Mark, edge: string) => {
    const chords = chordsOf(closedWay(outline));
    const isLeft = chords.reduce((sum, [[ax, ay], [bx, by]]) => sum + ax * by - bx * ay, 0) > 0;
    for (const [a, b] of chords) {
      if (turn(a, b, [eye.x, eye.y]) > 0 === isLeft) continue;
      const across = Math.abs(Math.sin(Math.atan2(b[1] - a[1], b[0] - a[0]) - eye.heading));
      fill(upright(a, b, lowM, highM), colour, 1, edge);
      fill(upright(a, b, lowM, highM), "#000000", 0.38 - 0.16 * across);
      const count = panes ? Math.min(6, Math.floor(distance(a, b) / PANE_M)) : 0;
      for (let pane = 0; pane < count; pane++) {
        const [left, right] = [0.25, 0.75].map((share) => pointBetween(a, b, (pane + share) / count));
        fill(upright(left!, right!, 0.12, 0.21), panes!);
      }
    }
  };
  const paintMark = (mark: Mark) => {
    const { way, widthM, colour, alpha = 1, lowM, highM = 0 } = mark;
    const isHair = widthM > 0 && widthM < 0.004 && way.length > 1;
    if (way.length === 1) {
      const [spot] = seen(eye, size, [[...way[0]!, highM]], false);
      if (spot) ball(spot, (widthM / 2) * pixelsAt(way[0]!), colour, alpha);
    } else if (isHair) {
      const points = seen(eye, size, way.map(([x, y]) => [x, y, highM] as const), false);
      g.beginPath();
      for (const point of points) g.lineTo(...point);
      g.strokeStyle = colour;
      g.lineWidth = mark.leastPx ?? 1;
      g.stroke();
    } else {
      const outline = widthM ? bandAlong(way, widthM) : way;
      const stands = highM > (lowM ?? 0);
      const edge = contrast ? "#ffffff" : "rgba(20,26,40,0.35)";
      if (stands) sides(outline, mark, edge);
      if (highM < HIGH_M) fill(level(outline, highM), colour, alpha, stands ? edge : "");
    }
  };

  const sky = g.createLinearGradient(0, 0, 0, horizon);
  skyOver(floor, theme).forEach((colour, k) => sky.addColorStop(k, colour));
  g.fillStyle = theme.ground;
  g.fillRect(0, horizon, size.width, size.height - horizon);
  g.fillStyle = sky;
  g.fillRect(0, 0, size.width, horizon);
  g.fillStyle = contrast ? "#ffffff" : theme.edge;
  g.fillRect(0, horizon - 1, size.width, 1.5);
  const { ground, pattern, flat, things } = mat ? marksOf(mat, floor, theme) : { ground: [], pattern: [], flat: [], things: [] };
  for (const mark of [...ground, ...pattern, ...flat, ...view.zones.flatMap((zone) => zoneMarks(zone, theme, contrast))]) paintMark(mark);
  for (const { x, y, radiusM, widthPx, colour, alpha, fill: inside } of view.rings) {
    const ring = ringOf([x, y], radiusM);
    paintMark(area(ring, colour, inside));
    g.globalAlpha = alpha;
    paintMark({ ...rim(ring, colour), leastPx: widthPx });
    g.globalAlpha = 1;
  }

  const paintCar = (car: CarLook, number: number) => {
    const half = (view.carM / 2) * car.size;
    const front: Point = [car.x + Math.cos(car.heading), car.y + Math.sin(car.heading)];
    const isAway = aheadOf({ x: car.x, y: car.y, heading: eye.heading }, front) > 0;
    const { far, body, near } = carMarks(car, half, isAway, contrast);
    for (const mark of [...far, ...body, ...near]) paintMark(mark);
    const px = half * pixelsAt([car.x, car.y]);
    const [rear] = seen(eye, size, [[car.x - half * 0.94 * Math.cos(car.heading), car.y - half * 0.94 * Math.sin(car.heading), half * 0.5]], false);
    if (px < NUMBERED_PX || !rear || !near.length || Math.cos(car.heading - eye.heading) < 0) return;
    ball(rear, 0.3 * px, plateColour(number));
    g.font = `700 ${Math.round(px * 0.42)}px ${pageFont()}`;
    g.textAlign = "center";
    g.textBaseline = "middle";
    g.fillStyle = DARK;
    g.fillText(String(number), ...rear);
  };
  const solids: Solid[] = things.map(({ footprint, marks }) => {
    const at = pointBetween(footprint[0]!, footprint.at(-1)!, 0.5);
    const hides = crossed(footprint, [eye.x, eye.y], chased) > 0;
    const paint = () => {
      g.globalAlpha = hides ? SHEER : 1;
      marks.forEach(paintMark);
      g.globalAlpha = 1;
    };
    return { at, footprint, paint };
  });
  for (const person of mat ? listOf(mat, "person") : []) {
    const at = personAt(person, view.tMs);
    const paint = () => {
      const [foot] = seen(eye, size, [[...at, 0]], false);
      if (!foot) return;
      g.save();
      g.translate(...foot);
      g.scale(PERSON_M * pixelsAt(at), PERSON_M * pixelsAt(at));
      figure(g, theme.person, view.tMs / 400 % 1);
      g.restore();
    };
    solids.push({ at, footprint: null, paint });
  }
  const near = view.cars.map((car, k) => ({ car, k, ahead: aheadOf(eye, [car.x, car.y]) })).filter(({ ahead }) => ahead > 0.1 && ahead < FARTHEST_M);
  for (const { car, k } of near.sort((a, b) => a.ahead - b.ahead).slice(0, MOST_CARS)) {
    solids.push({ at: [car.x, car.y], footprint: null, paint: () => paintCar(car, k) });
  }
  for (const { paint } of paintOrder(eye, solids)) paint();
}
