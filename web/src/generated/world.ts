/** Mats and pictures of worlds. Written by scripts/generate.py; don't edit. */

import type { MatDocument } from "./messages";

export type Point = readonly [number, number];

export interface Line {
  /** The points of a dark line on the floor, in order. */
  points_m: readonly Point[];
  /** How wide the line is. */
  width_m?: number;
  /** The radius of the arcs at its corners. */
  bend_m?: number;
  /** Whether it goes on from its last point to its first. */
  closed?: boolean;
}

export interface Patch {
  /** The corners of a dark patch, in order. */
  corners_m: readonly Point[];
}

export interface Spot {
  /** The centre of a round dark spot. */
  centre_m: Point;
  /** The radius of a round dark spot. */
  radius_m: number;
}

export interface Wall {
  /** Where the wall begins. */
  from_m: Point;
  /** Where the wall ends. */
  to_m: Point;
}

export interface Disc {
  /** The centre of a round obstacle. */
  centre_m: Point;
  /** The radius of a round obstacle. */
  radius_m: number;
}

export interface Polygon {
  /** The corners of a solid obstacle, in order. */
  corners_m: readonly Point[];
}

export interface Voice {
  /** When the word is said. */
  at_s: number;
  /** What is said. */
  word: "stop" | "go";
  /** The centre of the area in which it is heard. */
  centre_m?: Point;
  /** How far from centre_m it is heard. */
  radius_m?: number;
}

export interface Person {
  /** When the person is where; they walk straight from point to point. */
  path: readonly (readonly [number, number, number])[];
  /** Whether the path begins again at its end. */
  repeats?: boolean;
}

export interface Car {
  /** Where the car starts. */
  at_m: Point;
  /** Where the car faces. */
  heading_deg?: number;
  /** Whether the car leads. */
  role?: "leader" | "follower";
}

export interface Crowd {
  /** The number of cars. */
  cars: number;
  /** How many of them lead, evenly spread. */
  leaders?: number;
  /** The lower left corner of their area. */
  corner_m?: Point;
  /** The width and height of their area. */
  size_m?: Point;
  /** The least distance between two cars' centres. */
  spacing_m?: number;
  /** Whether they stand in rows or at random. */
  placement?: "grid" | "random";
  /** Where the cars face. */
  heading_deg?: number | string;
  /** The seed of the crowd's random numbers. */
  seed?: number;
}

/** How things on a mat are given, the lowest first. */
export const SHAPES = {
  "line": "line",
  "patch": "corners",
  "spot": "round",
  "wall": "ends",
  "disc": "round",
  "polygon": "corners",
  "person": "walk",
} as const;

/** Marks on the floor, in nobody's way. */
export const FLAT = ["line", "patch", "spot"] as const;

/** What a floor and the things on it may look like. */
export const FLOOR_NAMES = ["table", "classroom", "city", "night", "moon", "plain"] as const;

export type FloorName = (typeof FLOOR_NAMES)[number];

/** A motorcade-mat/1 document with all its keys. */
export interface Mat extends MatDocument {
  tick_ms?: number;
  size_m?: Point;
  edge?: "open" | "wall";
  floor?: FloorName;
  line?: readonly Line[];
  patch?: readonly Patch[];
  spot?: readonly Spot[];
  wall?: readonly Wall[];
  disc?: readonly Disc[];
  polygon?: readonly Polygon[];
  voice?: readonly Voice[];
  person?: readonly Person[];
  car?: readonly Car[];
  crowd?: readonly Crowd[];
  physics?: { collisions?: boolean; line_of_sight?: boolean; capture_ratio?: number; beam_half_angle_deg?: number; bit_error_rate?: number; wheel_noise?: number; };
}

/** What all cars show at a moment; the arrays lie in the received bytes. */
export interface Columns {
  x: Float32Array;  // m
  y: Float32Array;  // m
  heading: Float32Array;  // rad -3.14 to 3.14
  index: Uint16Array;
  wheels: Uint8Array;  // 0 to 15
  led: Uint8Array;  // 0 to 4
  flags: Uint8Array;
}

/** How many bytes the columns of so many cars take, up to a multiple of four. */
export const columnBytes = (cars: number): number => Math.ceil((17 * cars) / 4) * 4;

/** The columns of so many cars, which begin at a place of the bytes. */
export const columnsOf = (bytes: ArrayBuffer, begin: number, cars: number): Columns => ({
  x: new Float32Array(bytes, begin + 0 * cars, cars),
  y: new Float32Array(bytes, begin + 4 * cars, cars),
  heading: new Float32Array(bytes, begin + 8 * cars, cars),
  index: new Uint16Array(bytes, begin + 12 * cars, cars),
  wheels: new Uint8Array(bytes, begin + 14 * cars, cars),
  led: new Uint8Array(bytes, begin + 15 * cars, cars),
  flags: new Uint8Array(bytes, begin + 16 * cars, cars),
});

/** The index of a car that holds none of the image's words. */
export const NO_INDEX = 65535;

/** The LED of a car that lights none. */
export const NO_LED = 4;

/** The time whose lost frames a picture counts. */
export const LATELY_S = 5;

/** A picture has the newest events, at most so many. */
export const MOST_EVENTS = 4000;

/** Where the fields of a picture's header are. */
export const HEADER = {
  "kind": 0,
  "flags": 1,
  "reserved": 2,
  "number": 4,
  "t_ms": 8,
  "cars": 12,
  "events": 16,
  "lost": 20,
} as const;

/** Where the columns of a picture begin. */
export const HEADER_BYTES = 24;

/** The numbers of an event in a picture. */
export const EVENT_COLUMNS = 5;

/** `kind` has the kind in its lowest byte, and the reason in the one above. */
export const EventColumn = {"tMs": 0, "car": 1, "kind": 2, "word": 3, "other": 4} as const;

/** A car's flags in a picture. */
export const Flag = {"runs": 1, "sends": 2, "lost": 4, "heard": 8, "stuck": 16} as const;

/** The kinds of events, by number. */
export const KINDS = ["state", "start", "over", "frame", "heard", "lost", "flow"] as const;

/** Why a frame was lost, by number. */
export const LOSS_REASONS = ["", "parity", "reserved", "deaf", "sending", "collision", "check", "remote"] as const;
