/** Walls, obstacles and people as they are seen from behind a car. They look like what their floor says. */

import { isBetween, type Solid, solidAt } from "./chaseOrder";
import { DARK } from "./carPaint";
import type { ChasePen } from "./chasePen";
import { hexColour } from "./colours";
import { type FloorName, type Mat, personAt, type Point } from "./document";
import { carBefore, circleAt } from "./perspective";
import type { Sight } from "./scene";
import { BRICKS } from "./things";
import { ringOf } from "./ways";

const WALL_M = 0.1;
const THING_M = 0.14;
const HOUSE_M = 0.3;
const PERSON_M = 0.9;
const PERSON_RADIUS_M = 0.14;
/** What would hide the car that is looked after is seen through. */
const SHEER = 0.22;
/** A long wall is drawn in parts, so that each is sorted by its own distance. */
const PART_M = 0.5;
const MOST_PARTS = 40;

type Shape = (pen: ChasePen, x: number, y: number, radius: number, colour: string, rim: string | null) => void;

const drum: Shape = (pen, x, y, radius, colour, rim) => pen.prism(ringOf([x, y], radius), THING_M, colour, rim);

/** A ball above the floor, on a pole as wide as a share of it. */
const onPole =
  (pole: string, ball: string, highM: number, share: number): Shape =>
  (pen, x, y, radius) => {
    pen.prism(ringOf([x, y], radius * share, 10), highM, pole, null);
    const [px, py] = pen.spot(x, y, highM + radius * 0.6);
    const size = radius * pen.scaleAt(x, y);
    if (px === undefined || py === undefined) return;
    pen.dot(px, py, size, ball, DARK);
    pen.dot(px - size * 0.25, py - size * 0.25, size * 0.5, "rgba(255,255,255,0.22)", null);
  };

const DISCS: Partial<Record<FloorName, Shape>> = {
  classroom: (pen, x, y, radius) => {
    const [fx, fy] = pen.spot(x, y, 0);
    const [tx, ty] = pen.spot(x, y, radius * 2.2);
    if (fx === undefined || fy === undefined || tx === undefined || ty === undefined) return;
    pen.polygon(circleAt(x, y, radius), "#8a3410");
    const half = radius * 0.8 * pen.scaleAt(x, y);
    const band = (low: number, high: number, colour: string) => {
      const at = (share: number, side: number): [number, number] => [fx + (tx - fx) * share + side * half * (1 - share * 0.86), fy + (ty - fy) * share];
      pen.flat([...at(low, -1), ...at(low, 1), ...at(high, 1), ...at(high, -1)], colour);
    };
    band(0, 0.36, "#e8672c");
    band(0.36, 0.66, "#ffffff");
    band(0.66, 1, "#e8672c");
  },
  city: onPole("#6b4a2b", "#3f9a4c", 0.2, 0.22),
  night: (pen, x, y, radius, colour, rim) => {
    const [px, py] = pen.spot(x, y, 0.32);
    onPole("#3b4a74", "#ffe9b3", 0.26, 0.14)(pen, x, y, radius * 0.6, colour, rim);
    if (px !== undefined && py !== undefined) for (const share of [3.2, 2, 1.2]) pen.dot(px, py, radius * share * pen.scaleAt(x, y), "rgba(255,217,138,0.12)", null);
  },
  moon: (pen, x, y, radius) => {
    pen.polygon(circleAt(x, y, radius), "#c6c4bd");
    pen.polygon(circleAt(x, y, radius * 0.84), "#4a494f");
    pen.polygon(circleAt(x, y, radius * 0.6), "#6f6d6f");
  },
};

/** Windows along the sides of a house that can be seen. */
function windows(pen: ChasePen, corners: readonly Point[], colour: string): void {
  for (const [[ax, ay], [bx, by]] of pen.facing(corners)) {
    const whole = Math.hypot(bx - ax, by - ay);
    const count = Math.min(6, Math.floor(whole / 0.13));
    for (let k = 0; k < count; k++) {
      const at = (shift: number): Point => {
        const share = (k + 0.5) / count + shift / whole;
        return [ax + (bx - ax) * share, ay + (by - ay) * share];
      };
      const [from, to] = [at(-0.035), at(0.035)];
      pen.polygon([...from, 0.12, ...to, 0.12, ...to, 0.21, ...from, 0.21], colour);
    }
  }
}

function house(pen: ChasePen, corners: readonly Point[], colour: string, panes: string): void {
  pen.prism(corners, HOUSE_M, colour, null);
  windows(pen, corners, panes);
}

type Block = (pen: ChasePen, corners: readonly Point[], colour: string, rim: string | null) => void;

const POLYGONS: Partial<Record<FloorName, Block>> = {
  table: (pen, corners) => pen.prism(corners, THING_M, "#c4473a", null),
  city: (pen, corners, colour) => house(pen, corners, colour, "#dff1fb"),
  night: (pen, corners, colour) => house(pen, corners, colour, "#ffd98a"),
};
const crate: Block = (pen, corners, colour, rim) => pen.prism(corners, THING_M, colour, rim);

export function* thingsSeen(pen: ChasePen, { mat, floor, theme, contrast, picture }: Sight): Generator<Solid> {
  if (!mat) return;
  const rim = contrast ? "#ffffff" : null;
  const chased = carBefore(pen.eye);
  const solid = (at: Point, footprint: readonly Point[], paint: () => void): Solid => {
    const sheer = isBetween(footprint, pen.eye, chased);
    return solidAt(pen.eye, at, footprint, sheer ? () => pen.through(SHEER, paint) : paint);
  };
  for (const { ends, inner } of wallsOf(mat)) {
    for (const [k, [a, b]] of partsOf(...ends, inner && floor === "table" ? 0.11 : PART_M).entries()) {
      const corners = [...a, 0, ...b, 0, ...b, WALL_M, ...a, WALL_M];
      const colour = inner && floor === "table" ? hexColour(BRICKS[k % BRICKS.length]!) : theme.wall;
      yield solid(middleOf([a, b]), [a, b], () => pen.side(corners, colour, rim, 0));
    }
  }
  for (const { corners_m } of mat.polygon ?? []) {
    yield solid(middleOf(corners_m), corners_m, () => (POLYGONS[floor] ?? crate)(pen, corners_m, theme.obstacle, rim));
  }
  for (const { centre_m, radius_m } of mat.disc ?? []) {
    yield solid(centre_m, ringOf(centre_m, radius_m, 8), () => (DISCS[floor] ?? drum)(pen, ...centre_m, radius_m, theme.obstacle, rim));
  }
  for (const person of mat.person ?? []) {
    const [x, y] = personAt(person, picture?.tMs ?? 0);
    yield solid([x, y], ringOf([x, y], PERSON_RADIUS_M, 8), () => paintPerson(pen, x, y, theme.person));
  }
}

function paintPerson(pen: ChasePen, x: number, y: number, colour: string): void {
  const scale = pen.scaleAt(x, y);
  const [px, py] = pen.spot(x, y, 0);
  if (!scale || px === undefined || py === undefined) return;
  const { g } = pen;
  g.fillStyle = colour;
  g.strokeStyle = DARK;
  g.lineWidth = Math.max(1, scale * 0.012);
  g.beginPath();
  g.roundRect(px - PERSON_RADIUS_M * scale, py - 0.68 * PERSON_M * scale, 2 * PERSON_RADIUS_M * scale, 0.68 * PERSON_M * scale, 0.12 * scale);
  g.fill();
  g.stroke();
  pen.dot(px, py - 0.84 * PERSON_M * scale, 0.14 * scale, colour, DARK);
}

/** All walls; `inner` are those that stand on the mat. */
function wallsOf({ wall, size_m, edge }: Mat): { ends: [Point, Point]; inner: boolean }[] {
  const walls = (wall ?? []).map(({ from_m, to_m }) => ({ ends: [from_m, to_m] as [Point, Point], inner: true }));
  if (!size_m || edge !== "wall") return walls;
  const corners: Point[] = [[0, 0], [size_m[0], 0], size_m, [0, size_m[1]]];
  return [...walls, ...corners.map((corner, k) => ({ ends: [corner, corners[(k + 1) % 4]!] as [Point, Point], inner: false }))];
}

function partsOf([ax, ay]: Point, [bx, by]: Point, partM: number): [Point, Point][] {
  const parts = Math.min(MOST_PARTS, Math.max(1, Math.ceil(Math.hypot(bx - ax, by - ay) / partM)));
  const at = (k: number): Point => [ax + ((bx - ax) * k) / parts, ay + ((by - ay) * k) / parts];
  return Array.from({ length: parts }, (_, k) => [at(k), at(k + 1)]);
}

function middleOf(corners: readonly Point[]): Point {
  const sum = corners.reduce<Point>(([sx, sy], [x, y]) => [sx + x, sy + y], [0, 0]);
  return [sum[0] / corners.length, sum[1] / corners.length];
}
