/** What walls and obstacles look like on each floor. Their outlines stay exactly where cars bump into them. */

import type { Graphics } from "pixi.js";
import type { MatTheme } from "./colours";
import type { FloorName, Mat, Point } from "./document";

/** Lengths are millimetres; `rim` is the width of an outline. */
interface Look {
  disc: (g: Graphics, x: number, y: number, radius: number, theme: MatTheme, rim: number) => void;
  polygon: (g: Graphics, corners: readonly number[], theme: MatTheme, rim: number) => void;
  wall: (g: Graphics, from: Point, to: Point, theme: MatTheme, width: number) => void;
}

/** At most so many parts are drawn of one wall. */
const MOST_PARTS = 60;
const SHADE = { color: 0x0a1020, alpha: 0.2 };
/** Things are lit from above left. */
const SHADOW_MM = 22;

function middleOf(corners: readonly number[]): Point {
  let [x, y] = [0, 0];
  for (let at = 0; at < corners.length; at += 2) [x, y] = [x + corners[at]!, y + corners[at + 1]!];
  const count = corners.length / 2;
  return [x / count, y / count];
}

/** The outline, nearer to its middle. */
function shrunk(corners: readonly number[], share: number): number[] {
  const [x, y] = middleOf(corners);
  return corners.map((value, at) => (at % 2 ? y + (value - y) * share : x + (value - x) * share));
}

function shadow(g: Graphics, corners: readonly number[]): void {
  g.poly(corners.map((value, at) => (at % 2 ? value - SHADOW_MM : value + SHADOW_MM / 2))).fill(SHADE);
}

function roundShadow(g: Graphics, x: number, y: number, radius: number): void {
  g.circle(x + SHADOW_MM / 2, y - SHADOW_MM, radius).fill(SHADE);
}

/** Parts along a wall, about `length` long: the middle of each, its direction, and half its length. */
function alongWall(from: Point, to: Point, length: number): { x: number; y: number; angle: number; half: number; k: number }[] {
  const [dx, dy] = [to[0] - from[0], to[1] - from[1]];
  const whole = Math.hypot(dx, dy);
  const count = Math.min(MOST_PARTS, Math.max(1, Math.round(whole / length)));
  return Array.from({ length: count }, (_, k) => {
    const share = (k + 0.5) / count;
    return { x: from[0] + dx * share, y: from[1] + dy * share, angle: Math.atan2(dy, dx), half: whole / count / 2, k };
  });
}

function plank(g: Graphics, x: number, y: number, angle: number, half: number, wide: number): Graphics {
  const [cos, sin] = [Math.cos(angle), Math.sin(angle)];
  const corner = (along: number, across: number) => [x + along * cos - across * sin, y + along * sin + across * cos];
  return g.poly([...corner(-half, -wide), ...corner(half, -wide), ...corner(half, wide), ...corner(-half, wide)]);
}

/** A roof: each side of the outline has a slope up to the middle, the brighter the more it looks up left. */
function slopes(g: Graphics, corners: readonly number[], ridge: readonly number[]): void {
  for (let at = 0; at < corners.length; at += 2) {
    const next = (at + 2) % corners.length;
    const [ax, ay, bx, by] = [corners[at]!, corners[at + 1]!, corners[next]!, corners[next + 1]!];
    const light = Math.cos(Math.atan2(by - ay, bx - ax) + Math.PI / 4);
    g.poly([ax, ay, bx, by, ridge[next]!, ridge[next + 1]!, ridge[at]!, ridge[at + 1]!]).fill(
      light > 0 ? { color: 0x000000, alpha: 0.28 * light } : { color: 0xffffff, alpha: -0.3 * light },
    );
  }
}

const plain: Look = {
  disc: (g, x, y, radius, theme, rim) => void g.circle(x, y, radius).fill(theme.obstacle).stroke({ width: rim, color: theme.wall }),
  polygon: (g, corners, theme, rim) => void g.poly([...corners]).fill(theme.obstacle).stroke({ width: rim, color: theme.wall }),
  wall: (g, [ax, ay], [bx, by], theme, width) => void g.moveTo(ax, ay).lineTo(bx, by).stroke({ width, color: theme.wall, cap: "round" }),
};

/** Of toy walls. */
export const BRICKS = [0xd9483b, 0xf2b632, 0x3f8f5b, 0x3a74c4];

/** Toys on a table: tins, boxes with a lid, and rows of building bricks. */
const table: Look = {
  disc: (g, x, y, radius, theme, rim) => {
    roundShadow(g, x, y, radius);
    plain.disc(g, x, y, radius, theme, rim);
    g.circle(x, y, radius * 0.8).stroke({ width: Math.max(rim, radius * 0.05), color: 0xffffff, alpha: 0.65 });
    g.circle(x, y, radius * 0.34).fill({ color: 0xffffff, alpha: 0.3 });
  },
  polygon: (g, corners, theme, rim) => {
    shadow(g, corners);
    g.poly([...corners]).fill(0xc4473a).stroke({ width: rim, color: theme.wall });
    g.poly(shrunk(corners, 0.86)).fill({ color: 0xfff6e5, alpha: 0.95 });
    g.poly(shrunk(corners, 0.8)).fill(0xc4473a);
    g.poly(shrunk(corners, 0.4)).fill({ color: 0xf2b632 });
  },
  wall: (g, from, to, theme, width) => {
    const wide = Math.max(width / 2, 26);
    for (const { x, y, angle, half, k } of alongWall(from, to, 110)) {
      plank(g, x, y, angle, half, wide).fill(BRICKS[k % BRICKS.length]).stroke({ width: 5, color: theme.wall });
      g.circle(x, y, wide * 0.5).fill({ color: 0xffffff, alpha: 0.45 });
    }
  },
};

/** A classroom: traffic cones, wooden crates, and benches. */
const classroom: Look = {
  disc: (g, x, y, radius, theme, rim) => {
    roundShadow(g, x, y, radius);
    g.circle(x, y, radius).fill(0xe8672c).stroke({ width: rim, color: theme.wall });
    g.circle(x, y, radius * 0.66).fill(0xffffff);
    g.circle(x, y, radius * 0.44).fill(0xe8672c);
    g.circle(x, y, radius * 0.16).fill(0x8a3410);
  },
  polygon: (g, corners, theme, rim) => {
    shadow(g, corners);
    plain.polygon(g, corners, theme, rim);
    const inner = shrunk(corners, 0.82);
    g.poly(inner).stroke({ width: 10, color: 0x7a4a17, alpha: 0.8 });
    for (let at = 0; at + 4 < inner.length; at += 4) g.moveTo(inner[at]!, inner[at + 1]!).lineTo(inner[at + 4]!, inner[at + 5]!);
    g.stroke({ width: 10, color: 0x7a4a17, alpha: 0.6 });
  },
  wall: (g, from, to, theme, width) => {
    plain.wall(g, from, to, theme, Math.max(width, 44));
    plain.wall(g, from, to, { ...theme, wall: "#c99454" }, Math.max(width, 44) * 0.64);
  },
};

/** A town by day: trees, houses, and brick walls. */
const city: Look = {
  disc: (g, x, y, radius, _theme, rim) => {
    roundShadow(g, x, y, radius);
    g.circle(x, y, radius).fill(0x2f7d3b).stroke({ width: rim, color: 0x1d5226 });
    for (let k = 0; k < 6; k++) {
      const angle = (k * Math.PI) / 3 + 0.4;
      g.circle(x + radius * 0.52 * Math.cos(angle), y + radius * 0.52 * Math.sin(angle), radius * 0.36).fill({ color: k % 2 ? 0x3f9a4c : 0x57b163, alpha: 0.9 });
    }
    g.circle(x - radius * 0.1, y + radius * 0.12, radius * 0.34).fill(0x6fc47a);
  },
  polygon: (g, corners, theme, rim) => {
    shadow(g, corners);
    plain.polygon(g, corners, theme, rim);
    slopes(g, corners, shrunk(corners, 0.16));
    g.poly([...corners]).stroke({ width: rim, color: theme.wall });
  },
  wall: (g, from, to, theme, width) => {
    plain.wall(g, from, to, theme, Math.max(width, 40));
    for (const { x, y, angle, half, k } of alongWall(from, to, 90)) plank(g, x, y, angle, half * 0.84, Math.max(width, 40) * 0.3).fill(k % 2 ? 0xb9674d : 0xc97a5e);
  },
};

/** The same town by night: lamps, lit windows, and a fence with reflectors. */
const night: Look = {
  disc: (g, x, y, radius, _theme, rim) => {
    for (const share of [2.4, 1.8, 1.35]) g.circle(x, y, radius * share).fill({ color: 0xffd98a, alpha: 0.09 });
    g.circle(x, y, radius).fill(0x2a3557).stroke({ width: rim, color: 0x8aa0d6 });
    g.circle(x, y, radius * 0.55).fill(0xffd98a);
    g.circle(x, y, radius * 0.3).fill(0xfff6dc);
  },
  polygon: (g, corners, theme, rim) => {
    plain.polygon(g, corners, theme, rim);
    slopes(g, corners, shrunk(corners, 0.3));
    const sills = shrunk(corners, 0.62);
    for (let at = 0; at < sills.length; at += 2) {
      const next = (at + 2) % sills.length;
      const [ax, ay, bx, by] = [sills[at]!, sills[at + 1]!, sills[next]!, sills[next + 1]!];
      const wide = Math.min(26, Math.hypot(bx - ax, by - ay) * 0.16);
      plank(g, (ax + bx) / 2, (ay + by) / 2, Math.atan2(by - ay, bx - ax), wide, wide * 0.7).fill(0xffd98a);
    }
  },
  wall: (g, from, to, theme, width) => {
    plain.wall(g, from, to, { ...theme, wall: "#3d4c7c" }, Math.max(width, 36));
    for (const { x, y } of alongWall(from, to, 130)) g.circle(x, y, 15).fill(0xffd98a);
    plain.wall(g, from, to, theme, 6);
  },
};

/** The moon: craters, rocks, and ridges of stones. */
const moon: Look = {
  disc: (g, x, y, radius, theme, rim) => {
    g.circle(x, y, radius).fill(0xc6c4bd).stroke({ width: rim, color: theme.wall });
    g.circle(x, y, radius * 0.84).fill(0x56555b);
    g.circle(x + radius * 0.08, y - radius * 0.1, radius * 0.7).fill(0x6f6d6f);
    g.circle(x + radius * 0.14, y - radius * 0.2, radius * 0.46).fill(0x838180);
  },
  polygon: (g, corners, theme, rim) => {
    shadow(g, corners);
    plain.polygon(g, corners, theme, rim);
    slopes(g, corners, shrunk(corners, 0.42));
    g.poly(shrunk(corners, 0.42)).fill({ color: 0xd9d7d0, alpha: 0.5 });
  },
  wall: (g, from, to, theme, width) => {
    plain.wall(g, from, to, theme, Math.max(width, 30));
    for (const { x, y, half, k } of alongWall(from, to, 80)) {
      const radius = Math.min(half, 44) * (0.85 + 0.2 * Math.sin(k * 2.3));
      g.circle(x, y, radius).fill(k % 2 ? 0x77757a : 0x8c8a8b).stroke({ width: 5, color: theme.wall });
      g.circle(x - radius * 0.2, y + radius * 0.25, radius * 0.4).fill({ color: 0xffffff, alpha: 0.22 });
    }
  },
};

const LOOKS: Record<FloorName, Look> = { plain, table, classroom, city, night, moon };

/** Draw walls and obstacles; `rim` and `wall` are widths of outlines and walls, in millimetres. */
export function paintThings(g: Graphics, floor: FloorName, { wall = [], disc = [], polygon = [] }: Mat, theme: MatTheme, widths: { rim: number; wall: number }): void {
  const look = LOOKS[floor];
  const mm = ([x, y]: Point): Point => [x * 1000, y * 1000];
  for (const { corners_m } of polygon) look.polygon(g, corners_m.flatMap(mm), theme, widths.rim);
  for (const { centre_m, radius_m } of disc) look.disc(g, ...mm(centre_m), radius_m * 1000, theme, widths.rim);
  for (const { from_m, to_m } of wall) look.wall(g, mm(from_m), mm(to_m), theme, widths.wall);
}
