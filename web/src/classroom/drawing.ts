/** Small worlds: what a picture of the wall holds, and a world drawn on a canvas, seen from above. */

import { type Picture, Flag } from "../api/world";
import type { WallWorld } from "../generated/classroom";
import { columnBytes, columnsOf } from "../generated/world";
import { around, type Box, boxAround, boxOfMat, boxOfZone, grown } from "../mat/camera";
import { beacon, dot, face, follower, LAMPS, leader, shadow, wheel } from "../mat/carPaint";
import { hexColour, LEDS, pageFont } from "../mat/colours";
import { floorOf, listOf, type Mat } from "../mat/document";
import { floorMarks, groundOf } from "../mat/floors";
import { type Mark, roadMarks } from "../mat/marks";
import { inLanguage } from "./texts";

/** What a small world shows of its cars: some columns of a picture. */
export type Cars = Pick<Picture, "tMs" | "x" | "y" | "heading" | "led" | "flags" | "cars">;

const ZONE_NAME_PX = 15;
const HEAD_BYTES = 4;
const WORLD_HEAD_BYTES = 8;

/**
 * The worlds of a binary picture of the wall, by their place in the list `number`; null where the bytes are cut off.
 * `ClassWall` in motorcade/classroom/messages.py describes the format.
 */
export function decodeWall(bytes: ArrayBuffer): { number: number; worlds: Map<number, Cars> } | null {
  if (bytes.byteLength < HEAD_BYTES) return null;
  const view = new DataView(bytes);
  const worlds = new Map<number, Cars>();
  let at = HEAD_BYTES;
  while (at < bytes.byteLength) {
    if (at + WORLD_HEAD_BYTES > bytes.byteLength) return null;
    const [place, n] = [view.getUint16(at, true), view.getUint16(at + 2, true)];
    const tMs = view.getUint32(at + 4, true);
    const columns = at + WORLD_HEAD_BYTES;
    at = columns + columnBytes(n);
    if (at > bytes.byteLength) return null;
    worlds.set(place, { tMs, cars: n, ...columnsOf(bytes, columns, n) });
  }
  return { number: view.getUint32(0, true), worlds };
}

/** What draws the worlds of pupils, and what they show: a world that stands still is sent once, maybe before it has a tile. */
export class Tiles {
  private readonly draws = new Map<string, (cars: Cars) => void>();
  private readonly shown = new Map<string, Cars>();

  ready(pupil: string, draw: ((cars: Cars) => void) | null): void {
    const cars = this.shown.get(pupil);
    if (draw) this.draws.set(pupil, draw);
    else this.draws.delete(pupil);
    if (cars) draw?.(cars);
  }

  show(pupil: string, cars: Cars): void {
    this.shown.set(pupil, cars);
    this.draws.get(pupil)?.(cars);
  }

  /** Another list came: all worlds are sent anew. */
  forget(): void {
    this.shown.clear();
  }
}

const [GAP_PX, NAME_PX, LEAST_TILE_PX] = [10, 40, 150];
/** Width of a tile's world, its height being 1. */
const TILE_RATIO = 1.5;

/** The number of columns with which so many tiles fit into a page at the largest; a small page scrolls. */
export function columnsFor(tiles: number, width: number, height: number): number {
  const most = Math.max(1, Math.floor((width + GAP_PX) / (LEAST_TILE_PX + GAP_PX)));
  for (let columns = 1; columns < most; columns++) {
    const tile = (width - GAP_PX * (columns - 1)) / columns;
    const rows = Math.ceil(tiles / columns);
    if (rows * (tile / TILE_RATIO + NAME_PX) + GAP_PX * rows <= height) return columns;
  }
  return most;
}

const MARGIN_M = 0.3;

/** What to show: the whole mat where it has a size, else all cars, and what was shown before. */
export function boxOf(world: WallWorld, cars: Cars | undefined, before: Box | null): Box {
  const seen = cars && boxAround(cars.x, cars.y);
  return boxOfMat(world.mat) ?? around([before ?? { left: -1, bottom: -1, right: 1, top: 1 }, ...(seen ? [grown(seen, MARGIN_M)] : [])])!;
}

/** What a world is painted with. */
export const INKS = { floor: "--raised", thing: "--quiet", leader: "--leader", follower: "--followers", beam: "--running", text: "--text" } as const;
type Inks = Record<keyof typeof INKS, string>;

/** Smaller cars could not be seen on a tile. */
const LEAST_CAR_PX = 4;

/** A canvas whose coordinates are metres: the point at its lower left corner, and how many pixels a metre takes. */
interface View {
  context: CanvasRenderingContext2D;
  left: number;
  bottom: number;
  scale: number;
}

/** Where a point of the world is on the canvas. */
const spot = ({ left, bottom, scale }: View, x: number, y: number) => [left + x * scale, bottom - y * scale] as const;

/** Draw a world into a canvas of `width` by `height` pixels; `nameOf` gives what stands above a car, if anything. */
export function drawWorld(
  context: CanvasRenderingContext2D,
  { width, height }: { width: number; height: number },
  { world, cars, box, inks }: { world: WallWorld; cars: Cars | undefined; box: Box; inks: Inks },
  nameOf?: (car: number) => string | undefined,
): void {
  const scale = Math.min(width / (box.right - box.left), height / (box.top - box.bottom));
  const left = (width - (box.left + box.right) * scale) / 2;
  const bottom = (height + (box.bottom + box.top) * scale) / 2;
  const view: View = { context, left, bottom, scale };
  context.clearRect(0, 0, width, height);
  context.save();
  context.setTransform(scale, 0, 0, -scale, left, bottom);
  context.fillStyle = inks.floor;
  context.fillRect(box.left, box.bottom, box.right - box.left, box.top - box.bottom);
  drawFloor(context, world.mat, scale, inks.floor);
  drawMarks(context, roadMarks(world.mat));
  drawZones(view, world, inks);
  drawThings(context, world.mat, Math.max(2 / scale, 0.02), inks.thing);
  context.restore();
  const r = Math.max(LEAST_CAR_PX, world.radius_m * scale);
  for (let k = 0; k < (cars?.cars ?? 0); k++) {
    const [x, y] = spot(view, cars!.x[k]!, cars!.y[k]!);
    drawCar(context, { x, y, heading: cars!.heading[k]!, r }, inks, {
      leads: world.leads.includes(k),
      led: cars!.led[k]!,
      sends: (cars!.flags[k]! & Flag.sends) !== 0,
    });
    const name = nameOf?.(k);
    if (!name) continue;
    context.fillStyle = inks.text;
    context.font = `600 ${Math.max(18, r)}px ${pageFont()}`;
    context.textAlign = "center";
    // Dark floors need it.
    context.strokeStyle = inks.floor;
    context.lineWidth = 4;
    context.strokeText(name, x, y - r * 1.5);
    context.fillText(name, x, y - r * 1.5);
  }
}

/** On a smaller canvas the floor has one colour. */
const PATTERN_FROM_PX = 500;

/** Draw the floor as the studio's stage has it; `plain` is the page's colour. */
export function drawFloor(context: CanvasRenderingContext2D, mat: Mat, scale: number, plain: string): void {
  const floor = floorOf(mat);
  if (!mat.size_m) return;
  const [width, height] = mat.size_m;
  context.fillStyle = groundOf(floor) ?? plain;
  context.fillRect(0, 0, width, height);
  if (floor === "plain" || width * scale < PATTERN_FROM_PX) return;
  drawMarks(context, floorMarks(floor, mat.size_m, plain, listOf(mat, "line").length > 0));
}

function drawMarks(context: CanvasRenderingContext2D, marks: readonly Mark[]): void {
  context.lineCap = context.lineJoin = "round";
  for (const { way, widthM, colour, alpha = 1 } of marks) {
    context.beginPath();
    for (const point of way) context.lineTo(...point);
    context.globalAlpha = alpha;
    context.lineWidth = widthM;
    context.fillStyle = context.strokeStyle = colour;
    if (widthM) context.stroke();
    else context.fill();
  }
  context.globalAlpha = 1;
  context.lineCap = "butt";
  context.lineJoin = "miter";
}

/** Walls and obstacles in one ink. */
function drawThings(context: CanvasRenderingContext2D, { wall = [], disc = [], polygon = [] }: Mat, widthM: number, ink: string): void {
  context.fillStyle = context.strokeStyle = ink;
  context.lineWidth = widthM;
  context.beginPath();
  for (const { from_m, to_m } of wall) {
    context.moveTo(...from_m);
    context.lineTo(...to_m);
  }
  context.stroke();
  context.beginPath();
  for (const each of [...disc, ...polygon]) trace(context, each);
  context.fill();
}

/** A disc, a polygon, or a zone that is one of them. */
interface Outline {
  centre_m?: readonly number[] | null;
  radius_m?: number | null;
  corners_m?: readonly (readonly number[])[];
}

/** Add a disc or a polygon to the path. */
function trace(context: CanvasRenderingContext2D, { centre_m, radius_m, corners_m = [] }: Outline): void {
  if (centre_m && radius_m) {
    context.moveTo(centre_m[0]! + radius_m, centre_m[1]!);
    context.arc(centre_m[0]!, centre_m[1]!, radius_m, 0, Math.PI * 2);
  } else corners_m.forEach(([x, y], k) => (k === 0 ? context.moveTo(x!, y!) : context.lineTo(x!, y!)));
  context.closePath();
}

/** The zones of the world's mission: dashed outlines with their names, where there is room for these. */
function drawZones(view: View, { zones }: WallWorld, inks: Inks): void {
  const { context, scale } = view;
  context.save();
  context.strokeStyle = context.fillStyle = inks.beam;
  context.lineWidth = 2 / scale;
  context.setLineDash([8 / scale, 5 / scale]);
  context.beginPath();
  for (const zone of zones) trace(context, zone);
  context.stroke();
  context.resetTransform();
  context.font = `600 ${ZONE_NAME_PX}px ${pageFont()}`;
  context.textAlign = "center";
  for (const zone of zones) {
    const { left, right, bottom, top } = boxOfZone(zone);
    const name = inLanguage(zone.title);
    if (context.measureText(name).width > (right - left) * scale) continue;
    const [x, y] = spot(view, (left + right) / 2, (bottom + top) / 2);
    context.fillText(name, x, y + ZONE_NAME_PX / 3);
  }
  context.restore();
}

/** How many pixels half a car has in its picture, and how many half cars the picture is wide. */
const [HALF_PX, HALVES] = [64, 2.5];
/** The studio's picture of a car, by its colour and whether it leads. */
const carPictures = new Map<string, HTMLCanvasElement>();

function carPicture(colour: string, leads: boolean): HTMLCanvasElement {
  const key = `${colour} ${leads}`;
  const known = carPictures.get(key);
  if (known) return known;
  const [picture, body, tinted] = [0, 1, 2].map(() => Object.assign(document.createElement("canvas"), { width: HALF_PX * HALVES, height: HALF_PX * HALVES })) as [HTMLCanvasElement, HTMLCanvasElement, HTMLCanvasElement];
  const paint = (canvas: HTMLCanvasElement, how: (g: CanvasRenderingContext2D) => void, [x, y, halves]: readonly number[] = [0, 0, 1]) => {
    const g = canvas.getContext("2d")!;
    g.setTransform(HALF_PX * halves!, 0, 0, HALF_PX * halves!, HALF_PX * (HALVES / 2 + x!), HALF_PX * (HALVES / 2 + y!));
    g.lineJoin = g.lineCap = "round";
    how(g);
    g.setTransform(1, 0, 0, 1, 0, 0);
  };
  paint(picture, shadow, [-0.06, 0.1, HALVES / 2]);
  for (const y of [-0.68, 0.68]) paint(picture, wheel(0), [-0.06, y, 0.39]);
  paint(body, leads ? leader : follower);
  const g = tinted.getContext("2d")!;
  g.drawImage(body, 0, 0);
  g.globalCompositeOperation = "multiply";
  g.fillStyle = colour;
  g.fillRect(0, 0, body.width, body.height);
  // The tint has filled the ground too.
  g.globalCompositeOperation = "destination-in";
  g.drawImage(body, 0, 0);
  picture.getContext("2d")!.drawImage(tinted, 0, 0);
  paint(picture, face(true));
  if (leads) paint(picture, beacon, [-0.36, 0, 0.23]);
  carPictures.set(key, picture);
  return picture;
}

function drawCar(
  context: CanvasRenderingContext2D,
  { x, y, heading, r }: { x: number; y: number; heading: number; r: number },
  inks: Inks,
  { leads, led, sends }: { leads: boolean; led: number; sends: boolean },
): void {
  const half = leads ? r * 1.15 : r;
  context.save();
  context.translate(x, y);
  if (sends) {
    context.strokeStyle = inks.beam;
    context.lineWidth = Math.max(1.5, r / 5);
    context.beginPath();
    context.arc(0, 0, r * 1.7, 0, Math.PI * 2);
    context.stroke();
  }
  context.rotate(-heading);
  const side = half * HALVES;
  context.drawImage(carPicture(leads ? inks.leader : inks.follower, leads), -side / 2, -side / 2, side, side);
  const lamp = LAMPS[led];
  if (lamp) {
    const colour = hexColour(LEDS[led]!);
    dot(context, colour, lamp[0] * half, -lamp[1] * half, half * 0.28);
    context.globalAlpha = 0.35;
    dot(context, colour, lamp[0] * half, -lamp[1] * half, half * 0.8);
  }
  context.restore();
}
