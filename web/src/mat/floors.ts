/** What the floor looks like. A floor changes no physics: it is chosen for the eye alone. */

import type { FloorName } from "./document";
import type { MatTheme } from "./colours";

/** What a floor is drawn with: the stage's own drawing from above, and a record of shapes for the view behind a car. */
export interface FloorPen {
  rect(x: number, y: number, width: number, height: number): FloorPen;
  roundRect(x: number, y: number, width: number, height: number, radius: number): FloorPen;
  circle(x: number, y: number, radius: number): FloorPen;
  moveTo(x: number, y: number): FloorPen;
  lineTo(x: number, y: number): FloorPen;
  fill(style: { color: number; alpha?: number }): FloorPen;
  stroke(style: { width: number; color: number; alpha?: number }): FloorPen;
}

interface Floor {
  colours: Partial<MatTheme>;
  /** The colours of the sky above, at the top and at the horizon. */
  sky: readonly [string, string];
  paint: (g: FloorPen, width: number, height: number, hasRoads: boolean) => void;
}

/** The same numbers from 0 to 1 for the same place, so that a floor never flickers. */
function chance(x: number, y: number): number {
  const wild = Math.sin(x * 127.1 + y * 311.7) * 43758.5453;
  return wild - Math.floor(wild);
}

/** At most so many planks, tiles or streets are drawn: a hall has larger ones. */
const MOST = 40;
const stepFor = (length: number, wished: number) => wished * Math.max(1, Math.ceil(length / wished / MOST));

function planks(g: FloorPen, width: number, height: number): void {
  const step = stepFor(height, 160);
  for (let row = 0; row * step < height; row++) {
    const y = row * step;
    const high = Math.min(step, height - y);
    if (row % 2) g.rect(0, y, width, high).fill({ color: 0xd8b37e });
    g.moveTo(0, y).lineTo(width, y).stroke({ width: 4, color: 0xb98f58, alpha: 0.7 });
    for (let x = chance(row, 1) * 1200; x < width; x += 700 + 900 * chance(row, x)) g.rect(x, y, 4, high).fill({ color: 0xb98f58, alpha: 0.7 });
  }
}

function tiles(g: FloorPen, width: number, height: number): void {
  const step = stepFor(Math.max(width, height), 250);
  for (let row = 0; row * step < height; row++) {
    for (let column = row % 2; column * step < width; column += 2) {
      const [x, y] = [column * step, row * step];
      g.rect(x, y, Math.min(step, width - x), Math.min(step, height - y));
    }
  }
  g.fill({ color: 0xdfe7ea });
  for (let x = step; x < width; x += step) g.moveTo(x, 0).lineTo(x, height);
  for (let y = step; y < height; y += step) g.moveTo(0, y).lineTo(width, y);
  g.stroke({ width: 5, color: 0xc6d1d6 });
}

/** Streets with a dashed middle, in a grid: for the eye, where there are no roads that cars can follow. */
function paintStreets(g: FloorPen, width: number, height: number, block: number, street: number, line: number): void {
  const half = block * 0.17;
  for (let x = block / 2; x < width; x += block) g.rect(x - half, 0, Math.min(2 * half, width - x + half), height);
  for (let y = block / 2; y < height; y += block) g.rect(0, y - half, width, Math.min(2 * half, height - y + half));
  g.fill({ color: street });
  for (let x = block / 2; x < width; x += block) for (let y = 0; y < height; y += 240) g.rect(x - 8, y, 16, Math.min(120, height - y));
  for (let y = block / 2; y < height; y += block) for (let x = 0; x < width; x += 240) g.rect(x, y - 8, Math.min(120, width - x), 16);
  g.fill({ color: line, alpha: 0.8 });
}

function streets(street: number, line: number, lots: number) {
  return (g: FloorPen, width: number, height: number, hasRoads: boolean): void => {
    const block = stepFor(Math.max(width, height), 1400);
    if (!hasRoads) paintStreets(g, width, height, block, street, line);
    for (let x = block; x < width - 200; x += block) {
      for (let y = block; y < height - 200; y += block) {
        const side = block * (0.14 + 0.12 * chance(x, y));
        g.roundRect(x - side, y - side, 2 * side, 2 * side, 40);
      }
    }
    g.fill({ color: lots, alpha: 0.7 });
  };
}

function craters(g: FloorPen, width: number, height: number): void {
  const step = stepFor(Math.max(width, height), 520);
  for (let x = 0; x < width; x += step) {
    for (let y = 0; y < height; y += step) {
      const radius = step * (0.07 + 0.2 * chance(x, y));
      const [cx, cy] = [x + radius + chance(y, x) * (step - 2 * radius), y + radius + chance(x + 7, y) * (step - 2 * radius)];
      if (cx + radius > width || cy + radius > height) continue;
      g.circle(cx, cy, radius).fill({ color: 0x9f9d98 });
      g.circle(cx + radius * 0.12, cy - radius * 0.12, radius * 0.8).fill({ color: 0xb3b1ab });
    }
  }
}

const FLOORS: Record<FloorName, Floor | null> = {
  plain: null,
  table: {
    colours: { ground: "#b9926a", floor: "#e0bd8b", edge: "#8a6437", wall: "#7a5530", obstacle: "#4f7cac", track: "#fff6e5", range: "#a3231c", ring: "#c2261f" },
    sky: ["#f7ead6", "#e9d3b0"],
    paint: planks,
  },
  classroom: {
    colours: { ground: "#aebfc6", floor: "#edf2f3", edge: "#7f959e", wall: "#566b75", obstacle: "#d98b3a", track: "#a9bac2", range: "#c2261f", ring: "#c2261f" },
    sky: ["#f4f7f8", "#d5e1e6"],
    paint: tiles,
  },
  city: {
    colours: { ground: "#8fae84", floor: "#a9c49b", edge: "#5f7d55", wall: "#7b5b4b", obstacle: "#c8654f", track: "#e8efe2", range: "#8d1812", ring: "#c2261f" },
    sky: ["#7cbcf0", "#d8eefb"],
    paint: streets(0x6b7280, 0xf4e3a1, 0x8db27c),
  },
  night: {
    colours: { ground: "#0b0f1d", floor: "#182036", edge: "#3b4a74", wall: "#8aa0d6", obstacle: "#33426d", track: "#445590", range: "#ff8a80", ring: "#ff8a80", person: "#e0a252" },
    sky: ["#05070f", "#1c2748"],
    paint: streets(0x232c49, 0x5b6aa0, 0x141b2f),
  },
  moon: {
    colours: { ground: "#1b1c22", floor: "#aaa8a2", edge: "#66646a", wall: "#55545c", obstacle: "#7d7b76", track: "#d9d7d0", range: "#8d1812", ring: "#a3231c" },
    sky: ["#020308", "#14151c"],
    paint: craters,
  },
};

/** The page's colours with the floor's own in their place. */
export function withFloor(theme: MatTheme, name: FloorName): MatTheme {
  return { ...theme, ...FLOORS[name]?.colours };
}

/** The one colour of a floor in a small picture; undefined for a plain one, which has the page's own. */
export function groundOf(name: FloorName): string | undefined {
  return FLOORS[name]?.colours.floor;
}

/** Draw the floor's pattern, in millimetres; false for a plain floor. On a mat with roads a city has no others. */
export function paintFloor(g: FloorPen, name: FloorName, width: number, height: number, hasRoads: boolean): boolean {
  FLOORS[name]?.paint(g, width, height, hasRoads);
  return FLOORS[name] !== null;
}

/** The sky over a floor, at the top and at the horizon; a plain floor has none of its own. */
export function skyOver(name: FloorName, { ground }: MatTheme): readonly [string, string] {
  return FLOORS[name]?.sky ?? [ground, ground];
}
