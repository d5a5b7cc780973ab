/**
 * Paints a mat and its cars, seen from above: the one painter of stage, comparison, wall, projector and small pictures.
 *
 * A picture has two layers. The still one holds the floor, what is on it, the zones and the cars' tracks. It is kept for
 * each canvas, and painted anew only where mat, colours, zones, camera or size differ; lines that come to the tracks are
 * painted onto it. The moving one is painted each time: rings in the air, cars, people, and the grips of what is chosen.
 * Cars are put together of sprites that are painted once. Coordinates of marks are metres, with y up.
 */

import { type Camera, RADIUS_M } from "./camera";
import { type CarLook, MOST_RICH } from "./carLook";
import { paintBody, paintUnder, type SeenCar } from "./carPainter";
import { type MatTheme, pageFont } from "./colours";
import { type FloorName, listOf, type Mat, personAt, type Point } from "./document";
import { figure } from "./figure";
import { lookOf } from "./floors";
import type { Ring } from "./air";
import { type Marks, marksOf } from "./marks";
import type { Mark } from "./shapes";
import { lossSprite } from "./sprites";
import type { Tracks } from "./tracks";
import { zoneMarks, type ShownZone, zoneNames } from "./zones";

/** What is seen at a moment. */
export interface View {
  mat: Mat | null;
  /** The floor that shows, and the colours with its own in their place. */
  floor: FloorName;
  theme: MatTheme;
  contrast: boolean;
  /** The floor has its pattern; without it, one colour. */
  isDetailed: boolean;
  zones: readonly ShownZone[];
  /** What lies on the floor besides, below the cars. */
  below: readonly Mark[];
  tracks: Tracks | null;
  /** How long a car is, in metres, and how many pixels of the page it has at least. */
  carM: number;
  leastCarPx: number;
  cars: readonly CarLook[];
  /** The cars with a ring around them. */
  ringed: ReadonlySet<number>;
  rings: readonly Ring[];
  /** What lies above all else. */
  above: readonly Mark[];
  tMs: number;
}

/** A view of a mat alone: what else is to be seen is put into it. */
export const viewOf = (mat: Mat | null): View => ({
  mat,
  ...lookOf(mat),
  isDetailed: true,
  zones: [],
  below: [],
  tracks: null,
  carM: 2 * RADIUS_M,
  leastCarPx: 9,
  cars: [],
  ringed: new Set(),
  rings: [],
  above: [],
  tMs: 0,
});

const TRACK_M = 0.014;
const PERSON_M = 0.46;
const LEAST_PERSON_PX = 30;
const STEP_MS = 400;
const COUNTS_PX = 16;

/** A canvas with its camera: its middle and scale in pixels of the device, of which each pixel of the page has `sharpness`. */
interface Lens {
  g: CanvasRenderingContext2D;
  camera: Camera;
  scale: number;
  sharpness: number;
  middleX: number;
  middleY: number;
}

/** The still layer of each canvas, and of what it was painted. */
const stills = new WeakMap<CanvasRenderingContext2D, { canvas: HTMLCanvasElement; of: readonly unknown[] }>();

/** Paint a view on a canvas; `sharpness` is how many of its pixels a pixel of the page has. */
export function paint(context: CanvasRenderingContext2D, view: View, camera: Camera, sharpness = 1): void {
  const { width, height } = context.canvas;
  let still = stills.get(context);
  if (!still) stills.set(context, (still = { canvas: document.createElement("canvas"), of: [] }));
  const stillContext = still.canvas.getContext("2d", { alpha: false })!;
  const { mat, floor, theme, zones, below, isDetailed, tracks } = view;
  const of = [mat, floor, theme, zones, below, isDetailed, tracks?.version, camera.x, camera.y, camera.scale, sharpness, width, height];
  const stays = of.every((value, k) => value === still.of[k]);
  if (!stays && (still.canvas.width !== width || still.canvas.height !== height)) Object.assign(still.canvas, { width, height });
  const lensOf = (g: CanvasRenderingContext2D): Lens => ({ g, camera, scale: camera.scale * sharpness, sharpness, middleX: width / 2, middleY: height / 2 });
  if (stays) paintFresh(lensOf(stillContext), view);
  else paintStill(lensOf(stillContext), view);
  still.of = of;
  context.setTransform(1, 0, 0, 1, 0, 0);
  context.drawImage(still.canvas, 0, 0);
  paintMoving(lensOf(context), view);
}

/** From now on, coordinates are metres. */
function inMetres({ g, camera, scale, middleX, middleY }: Lens): void {
  g.setTransform(scale, 0, 0, -scale, middleX - camera.x * scale, middleY + camera.y * scale);
}

function paintStill(lens: Lens, view: View): void {
  const { g } = lens;
  const { mat, theme, floor, zones, tracks } = view;
  g.setTransform(1, 0, 0, 1, 0, 0);
  g.fillStyle = theme.ground;
  g.fillRect(0, 0, 2 * lens.middleX, 2 * lens.middleY);
  inMetres(lens);
  if (mat) {
    const marks = marksOf(mat, floor, theme);
    paintMarks(lens, marks.ground);
    if (view.isDetailed) paintMarks(lens, marks.pattern);
    paintMarks(lens, marks.flat);
    paintMarks(lens, thingMarks(marks));
  }
  for (const zone of zones) paintMarks(lens, zoneMarks(zone, theme, view.contrast));
  paintMarks(lens, view.below);
  for (const { paths, alpha } of tracks?.strips ?? []) {
    g.beginPath();
    for (const path of paths) {
      g.moveTo(path[0]!, path[1]!);
      for (let at = 2; at < path.length; at += 2) g.lineTo(path[at]!, path[at + 1]!);
    }
    strokeTrack(g, theme, alpha);
  }
  if (tracks) tracks.fresh = [];
  paintNames(lens, zones);
}

/** Add the lines that came to the tracks since the last painting. */
function paintFresh(lens: Lens, { tracks, theme }: View): void {
  if (!tracks?.fresh.length) return;
  const { g } = lens;
  inMetres(lens);
  g.beginPath();
  for (let at = 0; at < tracks.fresh.length; at += 4) {
    g.moveTo(tracks.fresh[at]!, tracks.fresh[at + 1]!);
    g.lineTo(tracks.fresh[at + 2]!, tracks.fresh[at + 3]!);
  }
  strokeTrack(g, theme, 1);
  tracks.fresh = [];
}

function strokeTrack(g: CanvasRenderingContext2D, { track }: MatTheme, alpha: number): void {
  g.globalAlpha = alpha;
  g.strokeStyle = track;
  g.lineWidth = TRACK_M;
  g.lineCap = g.lineJoin = "round";
  g.stroke();
  g.globalAlpha = 1;
}

/** The marks of all things, the lowest first: what is higher covers what is lower, whose ever it is. */
const byHeight = new WeakMap<Marks, readonly Mark[]>();

function thingMarks(marks: Marks): readonly Mark[] {
  let sorted = byHeight.get(marks);
  if (!sorted) {
    const all = marks.things.flatMap((thing) => thing.marks);
    sorted = all.sort((a, b) => (a.highM ?? 0) - (b.highM ?? 0));
    byHeight.set(marks, sorted);
  }
  return sorted;
}

/** Paint marks as they are from above; those that follow each other and look alike are one path. */
function paintMarks({ g, scale, sharpness }: Lens, marks: readonly Mark[]): void {
  g.lineCap = g.lineJoin = "round";
  marks.forEach((mark, k) => {
    const { way, widthM, colour, alpha = 1, leastPx = 0 } = mark;
    const before = marks[k - 1];
    const next = marks[k + 1];
    if (!before || !looksLike(before, mark)) g.beginPath();
    const wide = Math.max(widthM, (leastPx * sharpness) / scale);
    const [x, y] = way[0]!;
    if (way.length === 1) g.arc(x, y, wide / 2, 0, 2 * Math.PI);
    else {
      g.moveTo(x, y);
      for (let at = 1; at < way.length; at++) g.lineTo(way[at]![0], way[at]![1]);
      if (!widthM || isClosed(way)) g.closePath();
    }
    if (next && looksLike(mark, next)) return;
    g.globalAlpha = alpha;
    g.lineWidth = wide;
    g.fillStyle = g.strokeStyle = colour;
    if (widthM && way.length > 1) g.stroke();
    else g.fill();
  });
  g.globalAlpha = 1;
}

const isClosed = (way: readonly Point[]): boolean => way.length > 2 && way[0] === way.at(-1);

function looksLike(a: Mark, b: Mark): boolean {
  return a.colour === b.colour && a.widthM === b.widthM && a.alpha === b.alpha && a.leastPx === b.leastPx && a.way.length > 1 && b.way.length > 1;
}

function paintNames(lens: Lens, zones: readonly ShownZone[]): void {
  const { g, camera, sharpness, middleX, middleY } = lens;
  const size = { width: (2 * middleX) / sharpness, height: (2 * middleY) / sharpness };
  g.setTransform(sharpness, 0, 0, sharpness, 0, 0);
  g.lineJoin = "round";
  for (const { lines, font, x, y, lineHeight } of zoneNames(g, zones, camera, size)) {
    g.font = font;
    g.textAlign = "center";
    g.textBaseline = "top";
    lines.forEach((text, k) => writeOutlined(g, text, x, y + k * lineHeight));
  }
}

/** Write so that it is legible on each floor, by day and by night. */
function writeOutlined(g: CanvasRenderingContext2D, text: string, x: number, y: number): void {
  g.strokeStyle = "#14213d";
  g.lineWidth = 4;
  g.strokeText(text, x, y);
  g.fillStyle = "#ffffff";
  g.fillText(text, x, y);
}

function paintMoving(lens: Lens, view: View): void {
  const { g } = lens;
  inMetres(lens);
  for (const ring of view.rings) paintRing(lens, ring);
  paintCars(lens, view);
  for (const person of view.mat ? listOf(view.mat, "person") : []) {
    const [x, y] = personAt(person, view.tMs);
    const [nextX, nextY] = personAt(person, view.tMs + 50);
    const walks = nextX !== x || nextY !== y;
    const high = Math.max(PERSON_M * lens.scale, LEAST_PERSON_PX * lens.sharpness);
    const [px, py] = spot(lens, x, y);
    g.setTransform(nextX < x ? -high : high, 0, 0, high, px, py + high * 0.3);
    figure(g, view.theme.person, walks ? (view.tMs % STEP_MS) / STEP_MS : null);
  }
  inMetres(lens);
  paintMarks(lens, view.above);
}

function spot({ camera, scale, middleX, middleY }: Lens, x: number, y: number): readonly [number, number] {
  return [middleX + (x - camera.x) * scale, middleY - (y - camera.y) * scale];
}

function paintRing({ g, scale, sharpness }: Lens, { x, y, radiusM, widthPx, colour, alpha, fill }: Ring): void {
  g.beginPath();
  g.arc(x, y, radiusM, 0, 2 * Math.PI);
  g.fillStyle = g.strokeStyle = colour;
  if (fill) {
    g.globalAlpha = fill;
    g.fill();
  }
  g.globalAlpha = alpha;
  g.lineWidth = (widthPx * sharpness) / scale;
  g.stroke();
  g.globalAlpha = 1;
}

/** Paint shadows and light first, then bodies, then the signs above them, so that no car's shadow hides another. */
function paintCars(lens: Lens, view: View): void {
  const { g, sharpness } = lens;
  const side = Math.max(view.carM * lens.scale, view.leastCarPx * sharpness);
  const simple = view.cars.length > MOST_RICH;
  const seen: SeenCar[] = [];
  const { width, height } = g.canvas;
  view.cars.forEach((car, k) => {
    const [x, y] = spot(lens, car.x, car.y);
    const half = (side * car.size) / 2;
    const reach = 4 * half;
    if (x < -reach || y < -reach || x > width + reach || y > height + reach) return;
    seen.push({ car, k, x, y, half, cos: Math.cos(car.heading), sin: Math.sin(car.heading) });
  });
  if (!simple && !view.contrast) for (const at of seen) paintUnder(g, at);
  for (const at of seen) {
    if (!view.ringed.has(at.k) && !at.car.sends) continue;
    g.setTransform(1, 0, 0, 1, 0, 0);
    g.beginPath();
    g.arc(at.x, at.y, at.car.sends ? at.half * 1.7 : side * 0.72, 0, 2 * Math.PI);
    g.strokeStyle = at.car.sends ? view.theme.ring : view.theme.accent;
    g.lineWidth = 3 * sharpness;
    g.stroke();
  }
  for (const at of seen) paintBody(g, at, simple, view.contrast, sharpness);
  g.setTransform(1, 0, 0, 1, 0, 0);
  for (const { car, x, y, half } of seen) {
    if (car.loss) {
      const wide = Math.max(side * 0.26, 10 * sharpness);
      g.globalAlpha = car.loss.alpha;
      g.drawImage(lossSprite(car.loss.sign, view.theme.lost, wide), x - wide / 2, y - side * 0.62 - wide / 2, wide, wide);
      g.globalAlpha = 1;
    }
    g.textAlign = "center";
    if (car.counts) {
      g.font = `600 ${COUNTS_PX * sharpness}px ${pageFont()}`;
      g.textBaseline = "top";
      writeOutlined(g, car.counts, x, y + half * 1.3);
    }
    if (!car.name) continue;
    g.font = `600 ${Math.max(18, half)}px ${pageFont()}`;
    g.textBaseline = "alphabetic";
    writeOutlined(g, car.name, x, y - half * 1.5);
  }
}
