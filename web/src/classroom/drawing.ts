/** Small worlds: what a picture of the wall holds, and a world drawn on a canvas, seen from above. */

import { type Picture, Flag } from "../api/world";
import type { WallWorld } from "../generated/classroom";
import { inLanguage } from "../i18n";
import { beacon, face, follower, LAMPS, leader, shadow, wheel } from "../mat/carPaint";
import { hexColour, LEDS, pageFont } from "../mat/colours";
import { floorOf } from "../mat/document";
import { drawFloor } from "./floor";

/** What the cars of one world show; the first columns of a picture. */
export type Cars = Pick<Picture, "tMs" | "x" | "y" | "heading" | "led" | "flags" | "cars">;

const ZONE_NAME_PX = 15;
const HEAD_BYTES = 4;
const WORLD_HEAD_BYTES = 8;
const BYTES_A_CAR = 17;

/**
 * The worlds of a binary picture of the wall, by their place in the list `number`; null where the bytes are cut off.
 * `Wall` in motorcade/classroom/desk_messages.py describes the format.
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
    at = columns + Math.ceil((BYTES_A_CAR * n) / 4) * 4;
    if (at > bytes.byteLength) return null;
    worlds.set(place, {
      tMs,
      cars: n,
      x: new Float32Array(bytes, columns, n),
      y: new Float32Array(bytes, columns + 4 * n, n),
      heading: new Float32Array(bytes, columns + 8 * n, n),
      led: new Uint8Array(bytes, columns + 15 * n, n),
      flags: new Uint8Array(bytes, columns + 16 * n, n),
    });
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

export interface Box {
  left: number;
  bottom: number;
  right: number;
  top: number;
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

type Point = readonly [number, number];

interface MatParts {
  size_m?: Point;
  wall?: readonly { from_m: Point; to_m: Point }[];
  disc?: readonly { centre_m: Point; radius_m: number }[];
  polygon?: readonly { corners_m: readonly Point[] }[];
}

const MARGIN_M = 0.3;

/** What to show: the whole mat where it has a size, else all cars, and what was shown before. */
export function boxOf(world: WallWorld, cars: Cars | undefined, before: Box | null): Box {
  const { size_m } = world.mat as MatParts;
  if (size_m) return { left: 0, bottom: 0, right: size_m[0], top: size_m[1] };
  let box = before ?? { left: -1, bottom: -1, right: 1, top: 1 };
  for (let k = 0; k < (cars?.cars ?? 0); k++) {
    const [x, y] = [cars!.x[k]!, cars!.y[k]!];
    box = {
      left: Math.min(box.left, x - MARGIN_M),
      bottom: Math.min(box.bottom, y - MARGIN_M),
      right: Math.max(box.right, x + MARGIN_M),
      top: Math.max(box.top, y + MARGIN_M),
    };
  }
  return box;
}

export interface Inks {
  floor: string;
  thing: string;
  leader: string;
  follower: string;
  beam: string;
  text: string;
}

/** The colours of the page's theme. */
export function inksOf(element: Element): Inks {
  const style = getComputedStyle(element);
  const of = (name: string) => style.getPropertyValue(name).trim();
  return {
    floor: of("--raised"),
    thing: of("--quiet"),
    leader: of("--leader"),
    follower: of("--followers"),
    beam: of("--running"),
    text: of("--text"),
  };
}

/** Smaller cars could not be seen on a tile. */
const LEAST_CAR_PX = 4;

/** Draw a world into a canvas of `width` by `height` pixels; `nameOf` gives what stands above a car, if anything. */
export function drawWorld(
  context: CanvasRenderingContext2D,
  { width, height }: { width: number; height: number },
  { world, cars, box, inks }: { world: WallWorld; cars: Cars | undefined; box: Box; inks: Inks },
  nameOf?: (car: number) => string | undefined,
): void {
  const scale = Math.min(width / (box.right - box.left), height / (box.top - box.bottom));
  const left = (width - (box.right - box.left) * scale) / 2;
  const bottom = (height + (box.top - box.bottom) * scale) / 2;
  const X = (x: number) => left + (x - box.left) * scale;
  const Y = (y: number) => bottom - (y - box.bottom) * scale;
  const mat = world.mat as MatParts;
  context.clearRect(0, 0, width, height);
  context.fillStyle = inks.floor;
  context.fillRect(X(box.left), Y(box.top), (box.right - box.left) * scale, (box.top - box.bottom) * scale);
  if (mat.size_m) drawFloor(context, floorOf(world.mat), { left: X(0), bottom: Y(0), scale, size_m: mat.size_m, plain: inks.floor });
  drawZones(context, world, X, Y, scale, inks);
  context.fillStyle = context.strokeStyle = inks.thing;
  context.lineWidth = Math.max(2, 0.02 * scale);
  context.beginPath();
  for (const { from_m, to_m } of mat.wall ?? []) {
    context.moveTo(X(from_m[0]), Y(from_m[1]));
    context.lineTo(X(to_m[0]), Y(to_m[1]));
  }
  context.stroke();
  context.beginPath();
  for (const { centre_m, radius_m } of mat.disc ?? []) {
    context.moveTo(X(centre_m[0]) + radius_m * scale, Y(centre_m[1]));
    context.arc(X(centre_m[0]), Y(centre_m[1]), radius_m * scale, 0, Math.PI * 2);
  }
  for (const { corners_m } of mat.polygon ?? []) {
    corners_m.forEach(([x, y], k) => (k === 0 ? context.moveTo(X(x), Y(y)) : context.lineTo(X(x), Y(y))));
    context.closePath();
  }
  context.fill();
  const leads = new Set(world.leads);
  const r = Math.max(LEAST_CAR_PX, world.radius_m * scale);
  for (let k = 0; k < (cars?.cars ?? 0); k++) {
    drawCar(context, { x: X(cars!.x[k]!), y: Y(cars!.y[k]!), heading: cars!.heading[k]!, r }, inks, {
      leads: leads.has(k),
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
    context.strokeText(name, X(cars!.x[k]!), Y(cars!.y[k]!) - r * 1.5);
    context.fillText(name, X(cars!.x[k]!), Y(cars!.y[k]!) - r * 1.5);
  }
}

/** The zones of the world's mission: dashed outlines with their names, where there is room for these. */
function drawZones(
  context: CanvasRenderingContext2D,
  world: WallWorld,
  X: (x: number) => number,
  Y: (y: number) => number,
  scale: number,
  inks: Inks,
): void {
  context.save();
  context.strokeStyle = context.fillStyle = inks.beam;
  context.lineWidth = 2;
  context.setLineDash([8, 5]);
  context.font = `600 ${ZONE_NAME_PX}px ${pageFont()}`;
  context.textAlign = "center";
  for (const { title, corners_m, centre_m, radius_m } of world.zones) {
    const [xs, ys] = centre_m && radius_m !== null
      ? [[centre_m[0]! - radius_m, centre_m[0]! + radius_m], [centre_m[1]!]]
      : [corners_m.map(([x]) => x!), corners_m.map(([, y]) => y!)];
    context.beginPath();
    if (centre_m && radius_m !== null) context.arc(X(centre_m[0]!), Y(centre_m[1]!), radius_m * scale, 0, Math.PI * 2);
    else corners_m.forEach(([x, y], k) => (k === 0 ? context.moveTo(X(x!), Y(y!)) : context.lineTo(X(x!), Y(y!))));
    context.closePath();
    context.stroke();
    const [left, right, low, high] = [Math.min(...xs), Math.max(...xs), Math.min(...ys), Math.max(...ys)];
    const name = inLanguage(title);
    if (context.measureText(name).width > (right - left) * scale) continue;
    context.fillText(name, X((left + right) / 2), Y((low + high) / 2) + ZONE_NAME_PX / 3);
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
    context.fillStyle = hexColour(LEDS[led]!);
    context.beginPath();
    context.arc(lamp[0] * half, -lamp[1] * half, half * 0.28, 0, Math.PI * 2);
    context.fill();
    context.globalAlpha = 0.35;
    context.beginPath();
    context.arc(lamp[0] * half, -lamp[1] * half, half * 0.8, 0, Math.PI * 2);
    context.fill();
  }
  context.restore();
}
