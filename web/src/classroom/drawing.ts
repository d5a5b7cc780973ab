/** Small worlds: what a picture of the wall holds, and a world drawn on a canvas, seen from above. */

import { type Picture, Flag } from "../api/world";
import type { WallWorld } from "../generated/classroom";
import { columnBytes, columnsOf } from "../generated/world";
import { inLanguage, languageNow } from "../i18n";
import { around, type Box, boxAround, boxOfMat, cameraOn, grown } from "../mat/camera";
import { type CarLook, carAt } from "../mat/carLook";
import { paint, viewOf } from "../mat/painter";
import { once } from "../mat/ways";

/** What a small world shows of its cars: some columns of a picture. */
export type Cars = Pick<Picture, "tMs" | "x" | "y" | "heading" | "led" | "flags" | "cars">;

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

/** On a smaller canvas the floor has one colour. */
const PATTERN_FROM_PX = 500;

/** The zones of a world with their names in the page's language. */
const zonesOf = once(({ zones }: WallWorld) => ({ language: "", shown: zones.map((zone) => ({ zone, name: "", fits: true })) }));

/** Draw a world into a canvas of `sharpness` pixels for each of the page; `nameOf` gives what stands above a car, if anything. */
export function drawWorld(
  context: CanvasRenderingContext2D,
  { world, cars, box }: { world: WallWorld; cars: Cars | undefined; box: Box },
  nameOf: (car: number) => string | undefined = () => undefined,
  sharpness = 1,
): void {
  const size = { width: context.canvas.width / sharpness, height: context.canvas.height / sharpness };
  const zones = zonesOf(world);
  const language = languageNow();
  if (zones.language !== language) Object.assign(zones, { language, shown: zones.shown.map((shown) => ({ ...shown, name: inLanguage(shown.zone.title) })) });
  const view = viewOf(world.mat);
  const { leader, follower } = view.theme;
  const looks = Array.from({ length: cars?.cars ?? 0 }, (_, k): CarLook => {
    const leads = world.leads.includes(k);
    const look = carAt(cars!.x[k]!, cars!.y[k]!, cars!.heading[k]!, leads, leads ? leader : follower, cars!.led[k]);
    return { ...look, name: nameOf(k), sends: (cars!.flags[k]! & Flag.sends) !== 0 };
  });
  Object.assign(view, { zones: zones.shown, carM: 2 * world.radius_m, cars: looks, tMs: cars?.tMs ?? 0, isDetailed: size.width >= PATTERN_FROM_PX });
  paint(context, view, cameraOn(box, size), sharpness);
}
