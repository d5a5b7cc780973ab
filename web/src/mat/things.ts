/** What walls and obstacles look like on each floor. Their outlines stay exactly where cars bump into them. */

import type { MatTheme } from "./colours";
import type { FloorName, Mat, Point } from "./document";
import { area, disc, lifted, line, type Mark, plank, rectangle, rim, shrunk, standing, type Thing } from "./shapes";
import { chordsOf, closedWay, distance, pointBetween, ringOf } from "./ways";

interface Look {
  disc: (centre: Point, radius: number, theme: MatTheme) => Mark[];
  polygon: (corners: readonly Point[], theme: MatTheme) => Mark[];
  /** Parts about so long are told apart, and what each looks like. */
  partM: number;
  wall: (part: WallPart, theme: MatTheme) => Mark[];
}

/** A part of a wall: its ends, its middle, its direction, half its length, and its number. */
interface WallPart {
  from: Point;
  to: Point;
  middle: Point;
  angle: number;
  half: number;
  k: number;
}

/** At most so many parts are drawn of one wall. */
const MOST_PARTS = 60;
const SHADE = "#0a1020";
/** Things are lit from above left. */
const SHADOW_M = 0.022;
const WALL_M = 0.024;
const WALL_HIGH_M = 0.1;
/** What is on a wall comes after the walls themselves, which overlap each other. */
const WALL_TOP_M = 0.101;
const THING_M = 0.14;
const HOUSE_M = 0.3;
const EDGE_PART_M = 0.5;

const shadow = (corners: readonly Point[]): Mark => area(corners.map(([x, y]) => [x + SHADOW_M / 2, y - SHADOW_M]), SHADE, 0.2);

/** A wall's body: so wide, at least 4 pixels. */
const beam = ({ from, to }: WallPart, widthM: number, colour: string): Mark => standing({ ...line([from, to], widthM, colour), leastPx: 4 }, WALL_HIGH_M);

function partsOf(from: Point, to: Point, length: number): WallPart[] {
  const whole = distance(from, to);
  const count = Math.min(MOST_PARTS, Math.max(1, Math.round(whole / length)));
  const at = (share: number) => pointBetween(from, to, share);
  return Array.from({ length: count }, (_, k) => ({
    from: at(k / count),
    to: at((k + 1) / count),
    middle: at((k + 0.5) / count),
    angle: Math.atan2(to[1] - from[1], to[0] - from[0]),
    half: whole / count / 2,
    k,
  }));
}

/** A roof: each side of the outline has a slope up to the middle, the brighter the more it looks up left. */
function slopes(corners: readonly Point[], ridge: readonly Point[], highM: number): Mark[] {
  return corners.map((a, k) => {
    const next = (k + 1) % corners.length;
    const b = corners[next]!;
    const light = Math.cos(Math.atan2(b[1] - a[1], b[0] - a[0]) + Math.PI / 4);
    const colour = light > 0 ? "#000000" : "#ffffff";
    return lifted(area([a, b, ridge[next]!, ridge[k]!], colour, 0.3 * Math.abs(light)), highM);
  });
}

const drum = (centre: Point, radius: number, theme: MatTheme): Mark[] => {
  const ring = ringOf(centre, radius, 40);
  return [standing(area(ring, theme.obstacle), THING_M), lifted(rim(ring, theme.wall), THING_M)];
};

const crate = (corners: readonly Point[], colour: string, rimColour: string): Mark[] => [
  standing(area(corners, colour), THING_M),
  lifted(rim(corners, rimColour), THING_M),
];

const plain: Look = {
  disc: drum,
  polygon: (corners, theme) => crate(corners, theme.obstacle, theme.wall),
  partM: EDGE_PART_M,
  wall: (part, theme) => [beam(part, WALL_M, theme.wall)],
};

/** Of toy walls. */
const BRICKS = ["#d9483b", "#f2b632", "#3f8f5b", "#3a74c4"];

/** Toys on a table: tins, boxes with a lid, and rows of building bricks. */
const table: Look = {
  disc: (centre, radius, theme) => [
    shadow(ringOf(centre, radius)),
    ...drum(centre, radius, theme),
    lifted(rim(ringOf(centre, radius * 0.8, 40), "#ffffff", radius * 0.05, 0.65), THING_M),
    lifted(disc(centre, radius * 0.34, "#ffffff", 0.3), THING_M),
  ],
  polygon: (corners, theme) => [
    shadow(corners),
    ...crate(corners, "#c4473a", theme.wall),
    lifted(area(shrunk(corners, 0.86), "#fff6e5", 0.95), THING_M),
    lifted(area(shrunk(corners, 0.8), "#c4473a"), THING_M),
    lifted(area(shrunk(corners, 0.4), "#f2b632"), THING_M),
  ],
  partM: 0.11,
  wall: ({ middle, angle, half, k }, theme) => {
    const brick = plank(middle, angle, half, 0.026);
    return [
      standing(area(brick, BRICKS[k % BRICKS.length]!), WALL_TOP_M),
      lifted(rim(brick, theme.wall, 0.005), WALL_TOP_M),
      lifted(disc(middle, 0.013, "#ffffff", 0.45), WALL_TOP_M),
    ];
  },
};

/** A classroom: traffic cones, wooden crates, and benches. */
const classroom: Look = {
  disc: (centre, radius, theme) => [
    shadow(ringOf(centre, radius)),
    standing(disc(centre, radius, "#e8672c"), 0.03),
    lifted(rim(ringOf(centre, radius, 40), theme.wall), 0.03),
    standing(disc(centre, radius * 0.66, "#ffffff"), 0.12, 0.03),
    standing(disc(centre, radius * 0.44, "#e8672c"), 0.22, 0.12),
    lifted(disc(centre, radius * 0.16, "#8a3410"), 0.22),
  ],
  polygon: (corners, theme) => {
    const inner = shrunk(corners, 0.82);
    const boards: Mark[] = [];
    for (let k = 0; k + 2 < inner.length; k += 2) boards.push(lifted(line([inner[k]!, inner[k + 2]!], 0.01, "#7a4a17", 0.6), THING_M));
    return [shadow(corners), ...crate(corners, theme.obstacle, theme.wall), lifted(rim(inner, "#7a4a17", 0.01, 0.8), THING_M), ...boards];
  },
  partM: EDGE_PART_M,
  wall: (part, theme) => [beam(part, 0.044, theme.wall), lifted(line([part.from, part.to], 0.028, "#c99454"), WALL_TOP_M)],
};

/** A town by day: trees, houses, and brick walls. */
const city: Look = {
  disc: (centre, radius) => {
    const leaves = Array.from({ length: 6 }, (_, k): Mark => {
      const angle = (k * Math.PI) / 3 + 0.4;
      const at: Point = [centre[0] + radius * 0.52 * Math.cos(angle), centre[1] + radius * 0.52 * Math.sin(angle)];
      return lifted(disc(at, radius * 0.36, k % 2 ? "#3f9a4c" : "#57b163", 0.9), 0.26);
    });
    return [
      shadow(ringOf(centre, radius)),
      standing(disc(centre, radius * 0.22, "#6b4a2b"), 0.12),
      standing(disc(centre, radius, "#2f7d3b"), 0.26, 0.12),
      lifted(rim(ringOf(centre, radius, 40), "#1d5226"), 0.26),
      ...leaves,
      standing(disc([centre[0] - radius * 0.1, centre[1] + radius * 0.12], radius * 0.34, "#6fc47a"), 0.34, 0.26),
    ];
  },
  polygon: (corners, theme) => [
    shadow(corners),
    { ...standing(area(corners, theme.obstacle), HOUSE_M), panes: "#dff1fb" },
    ...slopes(corners, shrunk(corners, 0.16), HOUSE_M),
    lifted(rim(corners, theme.wall), HOUSE_M),
  ],
  partM: 0.09,
  wall: (part, theme) => [
    beam(part, 0.04, theme.wall),
    lifted(area(plank(part.middle, part.angle, part.half * 0.84, 0.012), part.k % 2 ? "#b9674d" : "#c97a5e"), WALL_TOP_M),
  ],
};

const LIGHT = "#ffd98a";

/** The same town by night: lamps, lit windows, and a fence with reflectors. */
const night: Look = {
  disc: (centre, radius) => [
    ...[2.4, 1.8, 1.35].map((share) => disc(centre, radius * share, LIGHT, 0.09)),
    standing(disc(centre, radius, "#2a3557"), 0.04),
    lifted(rim(ringOf(centre, radius, 40), "#8aa0d6"), 0.04),
    standing(disc(centre, radius * 0.2, "#3b4a74"), 0.26, 0.04),
    standing(disc(centre, radius * 0.55, LIGHT), 0.34, 0.26),
    lifted(disc(centre, radius * 0.3, "#fff6dc"), 0.34),
  ],
  polygon: (corners, theme) => {
    const sills = shrunk(corners, 0.62);
    const windows = chordsOf(closedWay(sills)).map(([a, b]) => {
      const wide = Math.min(0.026, distance(a, b) * 0.16);
      return lifted(area(plank(pointBetween(a, b, 0.5), Math.atan2(b[1] - a[1], b[0] - a[0]), wide, wide * 0.7), LIGHT), HOUSE_M);
    });
    return [
      { ...standing(area(corners, theme.obstacle), HOUSE_M), panes: LIGHT },
      ...slopes(corners, shrunk(corners, 0.3), HOUSE_M),
      lifted(rim(corners, theme.wall), HOUSE_M),
      ...windows,
    ];
  },
  partM: 0.13,
  wall: (part, theme) => [
    beam(part, 0.036, "#3d4c7c"),
    lifted(disc(part.middle, 0.015, LIGHT), WALL_TOP_M),
    lifted(line([part.from, part.to], 0.006, theme.wall), WALL_TOP_M),
  ],
};

/** The moon: craters, rocks, and ridges of stones. */
const moon: Look = {
  disc: ([x, y], radius, theme) => [
    disc([x, y], radius, "#c6c4bd"),
    rim(ringOf([x, y], radius, 40), theme.wall),
    disc([x, y], radius * 0.84, "#56555b"),
    disc([x + radius * 0.08, y - radius * 0.1], radius * 0.7, "#6f6d6f"),
    disc([x + radius * 0.14, y - radius * 0.2], radius * 0.46, "#838180"),
  ],
  polygon: (corners, theme) => [
    shadow(corners),
    ...crate(corners, theme.obstacle, theme.wall),
    ...slopes(corners, shrunk(corners, 0.42), THING_M),
    lifted(area(shrunk(corners, 0.42), "#d9d7d0", 0.5), THING_M),
  ],
  partM: 0.08,
  wall: (part, theme) => {
    const [x, y] = part.middle;
    const radius = Math.min(part.half, 0.044) * (0.85 + 0.2 * Math.sin(part.k * 2.3));
    const stone = ringOf([x, y], radius, 12);
    return [
      beam(part, 0.03, theme.wall),
      standing(area(stone, part.k % 2 ? "#77757a" : "#8c8a8b"), WALL_TOP_M),
      lifted(rim(stone, theme.wall, 0.005), WALL_TOP_M),
      lifted(disc([x - radius * 0.2, y + radius * 0.25], radius * 0.4, "#ffffff", 0.22), WALL_TOP_M),
    ];
  },
};

const LOOKS: Record<FloorName, Look> = { plain, table, classroom, city, night, moon };

/** The walls and obstacles that stand on a mat. */
export function thingsOn({ wall = [], disc: discs = [], polygon = [] }: Mat, floor: FloorName, theme: MatTheme): Thing[] {
  const look = LOOKS[floor];
  const parts = wall.flatMap(({ from_m, to_m }) => partsOf(from_m, to_m, look.partM));
  return [
    ...polygon.map(({ corners_m }) => ({ footprint: corners_m, marks: look.polygon(corners_m, theme) })),
    ...discs.map(({ centre_m, radius_m }) => ({ footprint: ringOf(centre_m, radius_m, 8), marks: look.disc(centre_m, radius_m, theme) })),
    ...parts.map((part) => ({ footprint: [part.from, part.to], marks: look.wall(part, theme) })),
  ];
}

/** The wall around a mat, which stands outside its edge; nothing where the edge is open. */
export function edgeThings({ size_m, edge }: Mat, theme: MatTheme): Thing[] {
  if (!size_m || edge !== "wall") return [];
  const corners = rectangle(-WALL_M / 2, -WALL_M / 2, size_m[0] + WALL_M / 2, size_m[1] + WALL_M / 2);
  const sides = chordsOf(closedWay(corners)).flatMap(([from, to]) => partsOf(from, to, EDGE_PART_M));
  return sides.map((part) => ({ footprint: [part.from, part.to], marks: [beam(part, WALL_M, theme.wall)] }));
}
