/** What is painted on a floor: shapes that every view draws in this order. */

import { type Mat, type Point, listOf } from "./document";
import { bandAlong, LINE_M, once, ringOf, wayOf } from "./ways";

/** A road as wide as a car needs, with light edges, around each line that is no wider than WIDEST_M. */
export const ROAD_M = 0.2;
const WIDEST_M = 0.1;
const EDGE_M = 0.02;
const CORNERS = 40;
/** They differ from each other, and so from any floor. */
export const ROAD_COLOURS = { edge: "#f4f2ea", bed: "#868c96", dark: "#17181c" } as const;

/** A line of a width along a way, or an area where that is 0; `alpha` is 1 where it isn't given. */
export interface Mark {
  way: readonly Point[];
  widthM: number;
  colour: string;
  alpha?: number;
}

/** The lines, spots and patches of a mat: first all edges, then all beds, then all that is dark, so that roads that cross are one. */
export const roadMarks = once((mat: Mat): readonly Mark[] => {
  const { edge, bed, dark } = ROAD_COLOURS;
  const lines = listOf(mat, "line").map((line) => ({ way: wayOf(line), widthM: line.width_m ?? LINE_M }));
  const areas = [...listOf(mat, "patch").map(({ corners_m }) => corners_m), ...listOf(mat, "spot").map(({ centre_m, radius_m }) => ringOf(centre_m, radius_m, CORNERS))];
  const rims = areas.map((corners) => ({ way: [...corners, corners[0]!], widthM: 2 * EDGE_M, colour: edge }));
  const roads = lines.filter(({ widthM }) => widthM <= WIDEST_M);
  return [
    ...rims,
    ...lines.map(({ way, widthM }) => ({ way, widthM: (widthM <= WIDEST_M ? ROAD_M : widthM) + 2 * EDGE_M, colour: edge })),
    ...roads.map(({ way }) => ({ way, widthM: ROAD_M, colour: bed })),
    ...areas.map((way) => ({ way, widthM: 0, colour: dark })),
    ...lines.map(({ way, widthM }) => ({ way, widthM, colour: dark })),
  ];
});

/** A mark as an area of the floor, each corner as x, y and 0, for views in perspective. */
export const cornersOf = ({ way, widthM }: Mark): number[] => (widthM ? bandAlong(way, widthM) : way).flatMap(([x, y]) => [x, y, 0]);
