/** The zones of a mission on the floor, below the cars, and their names. */

import type { MissionZone } from "../generated/messages";
import { type Box, boxOfZone, type Camera, type Size, toScreen } from "./camera";
import { type MatTheme, pageFont } from "./colours";
import type { Point } from "./document";
import { area, line, type Mark, rectangle, rim } from "./shapes";
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

function outlineOf({ corners_m, centre_m, radius_m }: MissionZone): readonly Point[] {
  if (centre_m && radius_m !== null) return ringOf(centre_m as unknown as Point, radius_m, 48);
  return corners_m as unknown as readonly Point[];
}

type Kind = "pond" | "crossing" | "garage" | "school" | "home" | "barn" | "field" | "stop" | "finish";

/** What a zone is, by words in its name or title, in each language that a teacher may write in. */
const WORDS: readonly (readonly [Kind, RegExp])[] = [
  ["pond", /pond|lake|water|river|池|湖|水|河/],
  ["crossing", /crossing|zebra|斑马线|人行横道/],
  ["stop", /stop|station|车站|站台/],
  ["garage", /garage|depot|parking|车库|停车/],
  ["school", /school|学校/],
  ["barn", /barn|farm|谷仓|农场/],
  ["field", /field|meadow|grass|草地|田/],
  ["finish", /finish|终点/],
  ["home", /home|house|家|房|户/],
];

function kindOf({ name, title }: MissionZone): Kind | null {
  const text = [name, ...Object.values(title)].join(" ").toLowerCase();
  return WORDS.find(([, words]) => words.test(text))?.[0] ?? null;
}

/** What must not be driven into has another colour than where to go. */
const DANGER = "#d1242f";
const ICON_SHARE = 0.3;
const MOST_ICON_M = 0.22;
const STRIPE_M = 0.08;
const HATCH_M = 0.16;
const MOST_STRIPES = 40;

/** An icon's areas in a square from -1 to 1, the lowest first. */
type Icon = readonly (readonly [colour: string, way: readonly Point[]])[];

const DOOR: Icon[number] = ["#7a4a17", rectangle(-0.2, -0.8, 0.2, -0.2)];
const windowsAt = (places: readonly Point[]): Icon => places.map(([x, y]) => ["#dff1fb", rectangle(x - 0.14, y - 0.14, x + 0.14, y + 0.14)]);

const ICONS: Partial<Record<Kind, Icon>> = {
  home: [["#fff4de", rectangle(-0.7, -0.8, 0.7, 0.15)], ["#c4473a", [[-1, 0.1], [1, 0.1], [0, 0.95]]], DOOR, ...windowsAt([[-0.45, -0.2], [0.45, -0.2]])],
  school: [
    ["#f2d9a8", rectangle(-1, -0.8, 1, 0.05)],
    ["#b5543c", [[-1.05, 0.05], [1.05, 0.05], [0.7, 0.4], [-0.7, 0.4]]],
    ["#6b4a2b", rectangle(-0.04, 0.4, 0.04, 1)],
    ["#d1242f", [[0.04, 0.7], [0.5, 0.85], [0.04, 1]]],
    DOOR,
    ...windowsAt([[-0.7, -0.3], [-0.4, -0.3], [0.4, -0.3], [0.7, -0.3]]),
  ],
  garage: [
    ["#8b95a5", [[-1, 0.35], [1, 0.35], [0, 0.85]]],
    ["#b8c0cc", rectangle(-0.9, -0.8, 0.9, 0.35)],
    ["#4f5a6b", rectangle(-0.65, -0.8, 0.65, 0.15)],
    ...[-0.6, -0.35, -0.1].map((y): Icon[number] => ["#77839a", rectangle(-0.65, y, 0.65, y + 0.1)]),
  ],
  barn: [
    ["#a8322a", [[-0.8, -0.8], [0.8, -0.8], [0.8, 0.2], [0.45, 0.7], [0, 0.9], [-0.45, 0.7], [-0.8, 0.2]]],
    ["#fff4de", rectangle(-0.35, -0.8, 0.35, 0)],
    ["#a8322a", rectangle(-0.27, -0.8, 0.27, -0.08)],
  ],
  stop: [
    ["#6b7280", rectangle(-0.06, -0.9, 0.06, 0.3)],
    ["#1f5fbf", ringOf([0, 0.5], 0.42, 24)],
    ["#ffffff", rectangle(-0.24, 0.35, 0.24, 0.62)],
    ["#ffffff", ringOf([-0.14, 0.32], 0.07, 10)],
    ["#ffffff", ringOf([0.14, 0.32], 0.07, 10)],
  ],
};

const GROUNDS: Partial<Record<Kind, { colour: string; alpha: number }>> = {
  pond: { colour: "#3f9bdc", alpha: 0.85 },
  field: { colour: "#7cc36a", alpha: 0.8 },
  crossing: { colour: "#5f6570", alpha: 0.35 },
};

/** Marks between the edges of a box: one for each step along its longer side, at most MOST_STRIPES. */
function along(box: Box, wishedM: number, mark: (from: number, to: number, isTall: boolean) => Mark): Mark[] {
  const isTall = box.top - box.bottom >= box.right - box.left;
  const [begin, end] = isTall ? [box.bottom, box.top] : [box.left, box.right];
  const count = Math.min(MOST_STRIPES, Math.max(1, Math.floor((end - begin) / wishedM)));
  const step = (end - begin) / count;
  return Array.from({ length: count }, (_, k) => mark(begin + k * step, begin + (k + 1) * step, isTall));
}

const PATTERNS: Partial<Record<Kind, (box: Box) => Mark[]>> = {
  crossing: (box) =>
    along(box, 2 * STRIPE_M, (from, to, isTall) => {
      const half = from + (to - from) / 2;
      return area(isTall ? rectangle(box.left, from, box.right, half) : rectangle(from, box.bottom, half, box.top), "#ffffff", 0.9);
    }),
  pond: ({ left, bottom, right, top }) =>
    [0.3, 0.5, 0.7].map((share, k) => {
      const [x, y] = [left + (right - left) * (0.32 + 0.18 * k), bottom + (top - bottom) * share];
      const wide = (right - left) * 0.12;
      return line([[x - wide, y], [x - wide / 2, y + wide * 0.3], [x, y], [x + wide / 2, y + wide * 0.3], [x + wide, y]], 0.012, "#ffffff", 0.75);
    }),
  field: ({ left, bottom, right, top }) =>
    Array.from({ length: 12 }, (_, k) => {
      const [x, y] = [left + (right - left) * (0.1 + 0.8 * ((k * 0.618) % 1)), bottom + (top - bottom) * (0.1 + 0.8 * ((k * 0.383) % 1))];
      return line([[x - 0.02, y + 0.04], [x, y], [x + 0.02, y + 0.04]], 0.01, "#3f8f3f");
    }),
  finish: ({ left, bottom, right, top }) => {
    const side = Math.max(0.04, Math.min(right - left, top - bottom) / 8);
    const columns = Math.min(MOST_STRIPES, Math.floor((right - left) / side));
    const white = area(rectangle(left, top - 2 * side, left + columns * side, top), "#ffffff", 0.9);
    const squares = Array.from({ length: columns }, (_, k) => {
      const low = top - (1 + (k % 2)) * side;
      return area(rectangle(left + k * side, low, left + (k + 1) * side, low + side), "#17181c", 0.9);
    });
    return [white, ...squares];
  },
};

/** Slanting lines over what must not be driven into, as far as they lie in its box. */
function hatch({ left, bottom, right, top }: Box): Mark[] {
  const reach = right - left + (top - bottom);
  const step = Math.max(HATCH_M, reach / MOST_STRIPES);
  const marks: Mark[] = [];
  for (let at = step / 2; at < reach; at += step) {
    const from: Point = [left + Math.max(0, at - (top - bottom)), bottom + Math.min(at, top - bottom)];
    const to: Point = [left + Math.min(at, right - left), bottom + Math.max(0, at - (right - left))];
    marks.push(line([from, to], 0.015, DANGER, 0.55));
  }
  return marks;
}

/** A zone looks like what it is; the rim says whether to go there or to keep away. High contrast has rims and hatching alone. */
export function zoneMarks({ zone }: ShownZone, theme: MatTheme, contrast: boolean): Mark[] {
  const outline = outlineOf(zone);
  const box = boxOfZone(zone);
  const kind = contrast ? null : kindOf(zone);
  const avoided = zone.avoid;
  const colour = avoided ? DANGER : theme.accent;
  const ground = (kind && GROUNDS[kind]) ?? { colour, alpha: 0.18 };
  const marks = [area(outline, ground.colour, ground.alpha), ...((kind && PATTERNS[kind]?.(box)) ?? [])];
  if (avoided && !(kind && GROUNDS[kind]) && !zone.centre_m) marks.push(...hatch(box));
  const icon = (kind && ICONS[kind]) ?? [];
  const half = Math.min(MOST_ICON_M, ICON_SHARE * Math.min(box.right - box.left, box.top - box.bottom));
  const [x, y] = [(box.left + box.right) / 2, (box.bottom + box.top) / 2];
  for (const [ink, way] of icon) marks.push(area(way.map(([px, py]): Point => [x + px * half, y + py * half]), ink));
  marks.push({ ...rim(outline, "#ffffff"), leastPx: 5, alpha: 0.8 }, { ...rim(outline, colour), leastPx: 3 });
  return marks;
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

const bottomOf = ({ y, lines, lineHeight }: ZoneName) => y + lines.length * lineHeight;
const meet = (a: ZoneName, b: ZoneName) => Math.abs(a.x - b.x) < (a.width + b.width) / 2 && a.y < bottomOf(b) && b.y < bottomOf(a);

/** The names of zones, at the upper edge of each, since cars come to the middle; none lies over another. */
export function zoneNames(g: CanvasRenderingContext2D, zones: readonly ShownZone[], camera: Camera, size: Size): ZoneName[] {
  const font = `bold ${NAME_PX}px ${pageFont()}`;
  g.font = font;
  const shown: ZoneName[] = [];
  for (const { zone, name, fits } of zones) {
    if (!name) continue;
    const { left, right, top } = boxOfZone(zone);
    const lines = wrapped(g, name);
    const width = Math.max(...lines.map((text) => g.measureText(text).width));
    if (fits && width > (right - left) * camera.scale) continue;
    const [x, y] = toScreen(camera, size, [(left + right) / 2, top]);
    const made = { lines, font, x, y: y + NAME_AIR_PX, width, lineHeight: LINE_PX };
    if (!shown.some((other) => meet(other, made))) shown.push(made);
  }
  return shown;
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
