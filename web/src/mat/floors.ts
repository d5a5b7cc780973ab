/** What the floor looks like. A floor changes no physics: it is chosen for the eye alone. */

import { isContrast, type MatTheme, readTheme, watchTheme } from "./colours";
import { type FloorName, floorOf, type Mat, type Point } from "./document";
import { area, line, type Mark, rectangle } from "./shapes";
import { ringOf } from "./ways";

interface Floor {
  colours: Partial<MatTheme>;
  /** The colours of the sky above, at the top and at the horizon. */
  sky: readonly [string, string];
  /** The pattern of a floor of a size in metres. */
  marks: (width: number, height: number, hasRoads: boolean) => Mark[];
}

/** A rectangle from its lower left corner. */
const slab = (x: number, y: number, width: number, height: number, colour: string, alpha = 1): Mark =>
  area(rectangle(x, y, x + width, y + height), colour, alpha);

/** Lines all over a floor, a step from each other. */
function gridOf(width: number, height: number, step: number, colour: string, widthM: number): Mark[] {
  const marks: Mark[] = [];
  for (let x = step; x < width; x += step) marks.push(line([[x, 0], [x, height]], widthM, colour));
  for (let y = step; y < height; y += step) marks.push(line([[0, y], [width, y]], widthM, colour));
  return marks;
}

/** The same numbers from 0 to 1 for the same place, so that a floor never flickers. */
function chance(x: number, y: number): number {
  const wild = Math.sin(x * 127.1 + y * 311.7) * 43758.5453;
  return wild - Math.floor(wild);
}

const GRID_STEPS_M = [0.5, 1, 5, 10, 100];
const MOST_GRID_LINES = 200;
/** At most so many planks, tiles or streets are drawn: a hall has larger ones. */
const MOST = 40;
const stepFor = (length: number, wished: number) => wished * Math.max(1, Math.ceil(length / wished / MOST));

function planks(width: number, height: number): Mark[] {
  const marks: Mark[] = [];
  const step = stepFor(height, 0.16);
  for (let row = 0; row * step < height; row++) {
    const y = row * step;
    const high = Math.min(step, height - y);
    if (row % 2) marks.push(slab(0, y, width, high, "#d8b37e"));
    marks.push(slab(0, y - 0.002, width, 0.004, "#b98f58", 0.7));
    for (let x = chance(row, 1) * 1.2; x < width; x += 0.7 + 0.9 * chance(row, x)) marks.push(slab(x, y, 0.004, high, "#b98f58", 0.7));
  }
  return marks;
}

function tiles(width: number, height: number): Mark[] {
  const marks: Mark[] = [];
  const step = stepFor(Math.max(width, height), 0.25);
  for (let row = 0; row * step < height; row++) {
    for (let column = row % 2; column * step < width; column += 2) {
      const [x, y] = [column * step, row * step];
      marks.push(slab(x, y, Math.min(step, width - x), Math.min(step, height - y), "#dfe7ea"));
    }
  }
  return [...marks, ...gridOf(width, height, step, "#c6d1d6", 0.005)];
}

/** Streets with a dashed middle, in a grid: for the eye, where there are no roads that cars can follow. */
function streetsOf(width: number, height: number, block: number, street: string, dash: string): Mark[] {
  const marks: Mark[] = [];
  const half = block * 0.17;
  for (let x = block / 2; x < width; x += block) marks.push(slab(x - half, 0, Math.min(2 * half, width - x + half), height, street));
  for (let y = block / 2; y < height; y += block) marks.push(slab(0, y - half, width, Math.min(2 * half, height - y + half), street));
  for (let x = block / 2; x < width; x += block) {
    for (let y = 0; y < height; y += 0.24) marks.push(slab(x - 0.008, y, 0.016, Math.min(0.12, height - y), dash, 0.8));
  }
  for (let y = block / 2; y < height; y += block) {
    for (let x = 0; x < width; x += 0.24) marks.push(slab(x, y - 0.008, Math.min(0.12, width - x), 0.016, dash, 0.8));
  }
  return marks;
}

function town(street: string, dash: string, lots: string) {
  return (width: number, height: number, hasRoads: boolean): Mark[] => {
    const block = stepFor(Math.max(width, height), 1.4);
    const marks = hasRoads ? [] : streetsOf(width, height, block, street, dash);
    for (let x = block; x < width - 0.2; x += block) {
      for (let y = block; y < height - 0.2; y += block) {
        const side = block * (0.14 + 0.12 * chance(x, y));
        marks.push(slab(x - side, y - side, 2 * side, 2 * side, lots, 0.7));
      }
    }
    return marks;
  };
}

function craters(width: number, height: number): Mark[] {
  const marks: Mark[] = [];
  const step = stepFor(Math.max(width, height), 0.52);
  for (let x = 0; x < width; x += step) {
    for (let y = 0; y < height; y += step) {
      const radius = step * (0.07 + 0.2 * chance(x, y));
      const [cx, cy] = [x + radius + chance(y, x) * (step - 2 * radius), y + radius + chance(x + 7, y) * (step - 2 * radius)];
      if (cx + radius > width || cy + radius > height) continue;
      marks.push(area(ringOf([cx, cy], radius), "#9f9d98"), area(ringOf([cx + radius * 0.12, cy - radius * 0.12], radius * 0.8), "#b3b1ab"));
    }
  }
  return marks;
}

const FLOORS: Record<FloorName, Floor | null> = {
  plain: null,
  table: {
    colours: {
      ground: "#b9926a", floor: "#e0bd8b", edge: "#8a6437", wall: "#7a5530",
      obstacle: "#4f7cac", track: "#fff6e5", range: "#a3231c", ring: "#c2261f",
    },
    sky: ["#f7ead6", "#e9d3b0"],
    marks: planks,
  },
  classroom: {
    colours: {
      ground: "#aebfc6", floor: "#edf2f3", edge: "#7f959e", wall: "#566b75",
      obstacle: "#d98b3a", track: "#a9bac2", range: "#c2261f", ring: "#c2261f",
    },
    sky: ["#f4f7f8", "#d5e1e6"],
    marks: tiles,
  },
  city: {
    colours: {
      ground: "#8fae84", floor: "#a9c49b", edge: "#5f7d55", wall: "#7b5b4b",
      obstacle: "#c8654f", track: "#e8efe2", range: "#8d1812", ring: "#c2261f",
    },
    sky: ["#7cbcf0", "#d8eefb"],
    marks: town("#6b7280", "#f4e3a1", "#8db27c"),
  },
  night: {
    colours: {
      ground: "#0b0f1d", floor: "#182036", edge: "#3b4a74", wall: "#8aa0d6",
      obstacle: "#33426d", track: "#445590", range: "#ff8a80", ring: "#ff8a80", person: "#e0a252",
    },
    sky: ["#05070f", "#1c2748"],
    marks: town("#232c49", "#5b6aa0", "#141b2f"),
  },
  moon: {
    colours: {
      ground: "#1b1c22", floor: "#aaa8a2", edge: "#66646a", wall: "#55545c",
      obstacle: "#7d7b76", track: "#d9d7d0", range: "#8d1812", ring: "#a3231c",
    },
    sky: ["#020308", "#14151c"],
    marks: craters,
  },
};

/** The colours of each floor that was asked for, until the page's own change. */
const themes = new Map<FloorName, MatTheme>();
watchTheme(() => themes.clear());

/** How a mat is painted: its floor, and the page's colours with the floor's own in their place; high contrast has no pictures on the floor. */
export function lookOf(mat: Mat | null): { floor: FloorName; theme: MatTheme; contrast: boolean } {
  const contrast = isContrast();
  const floor = contrast ? "plain" : floorOf(mat);
  let theme = themes.get(floor);
  if (!theme) themes.set(floor, (theme = { ...readTheme(document.body), ...FLOORS[floor]?.colours }));
  return { floor, theme, contrast };
}

/** The pattern of a floor of a size in metres; a plain one has a grid. On a mat with roads a city has no others. */
export function floorMarks(name: FloorName, [width, height]: Point, gridColour: string, hasRoads: boolean): Mark[] {
  const step = GRID_STEPS_M.find((each) => (width + height) / each < MOST_GRID_LINES) ?? 1000;
  return FLOORS[name]?.marks(width, height, hasRoads) ?? gridOf(width, height, step, gridColour, 0.004);
}

/** The sky over a floor, at the top and at the horizon; a plain floor has none of its own. */
export function skyOver(name: FloorName, { ground }: MatTheme): readonly [string, string] {
  return FLOORS[name]?.sky ?? [ground, ground];
}
