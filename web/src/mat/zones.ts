/** The zones of a mission on the floor, below the cars, and their names. */

import type { MissionZone } from "../generated/messages";
import { boxOfZone, type Camera, type Size, toScreen } from "./camera";
import { type MatTheme, pageFont } from "./colours";
import type { Point } from "./document";
import { area, type Mark, rim } from "./shapes";
import { ringOf } from "./ways";

/** A zone with what is written on it; null for nothing. Where `fits`, only what it has room for. */
export interface ShownZone {
  zone: MissionZone;
  name: string | null;
  fits: boolean;
}

const NAME_PX = 14;
const LINE_PX = 17;
const WIDEST_PX = 110;
/** Between the edge of a zone and its name. */
const NAME_AIR_PX = 4;

export function outlineOf({ corners_m, centre_m, radius_m }: MissionZone): readonly Point[] {
  if (centre_m && radius_m !== null) return ringOf(centre_m as unknown as Point, radius_m, 48);
  return corners_m as unknown as readonly Point[];
}

export function zoneMarks({ zone }: ShownZone, theme: MatTheme): Mark[] {
  const outline = outlineOf(zone);
  return [area(outline, theme.accent, 0.18), { ...rim(outline, theme.accent), alpha: 0.9 }];
}

/** A name on the canvas: the middle of its upper edge, in pixels of the page. */
export interface ZoneName {
  lines: readonly string[];
  font: string;
  x: number;
  y: number;
  width: number;
  lineHeight: number;
}

/** The names of zones, at the upper edge of each, since cars come to the middle. */
export function zoneNames(g: CanvasRenderingContext2D, zones: readonly ShownZone[], camera: Camera, size: Size): ZoneName[] {
  const font = `bold ${NAME_PX}px ${pageFont()}`;
  g.font = font;
  return zones.flatMap(({ zone, name, fits }) => {
    if (!name) return [];
    const { left, right, top } = boxOfZone(zone);
    const lines = wrapped(g, name);
    const width = Math.max(...lines.map((text) => g.measureText(text).width));
    if (fits && width > (right - left) * camera.scale) return [];
    const [x, y] = toScreen(camera, size, [(left + right) / 2, top]);
    return [{ lines, font, x, y: y + NAME_AIR_PX, width, lineHeight: LINE_PX }];
  });
}

/** A text in lines that are no wider than WIDEST_PX, broken between words. */
function wrapped(g: CanvasRenderingContext2D, text: string): string[] {
  const lines: string[] = [];
  for (const word of text.split(" ")) {
    const longer = lines.length ? `${lines.at(-1)!} ${word}` : word;
    if (lines.length && g.measureText(longer).width <= WIDEST_PX) lines[lines.length - 1] = longer;
    else lines.push(word);
  }
  return lines;
}
