/**
 * What a mat looks like, as marks: areas, lines and balls with a colour and a height, which every view draws.
 *
 * `marksOf` gives the marks of what lies on the floor, in the order in which they are painted, and apart from them
 * those of each thing that stands on it. From above, marks are painted flat; the view from behind a car extrudes them
 * from `lowM` to `highM`. What moves, cars and people, comes from the moment that is shown, and isn't here.
 */

import { boxOfMat } from "./camera";
import type { MatTheme } from "./colours";
import { type FloorName, listOf, type Mat, type Point } from "./document";
import { floorMarks } from "./floors";
import { area, line, type Mark, rectangle, rim, type Thing } from "./shapes";
import { edgeThings, thingsOn } from "./things";
import { closedWay, LINE_M, once, ringOf, wayOf } from "./ways";

/** A road as wide as a car needs, with light edges, around each line that is no wider than WIDEST_M. */
export const ROAD_M = 0.2;
const WIDEST_M = 0.1;
const EDGE_M = 0.02;
const CORNERS = 40;
const EDGE_PX = 1.5;
/** They differ from each other, and so from any floor. */
export const ROAD_COLOURS = { edge: "#f4f2ea", bed: "#868c96", dark: "#17181c" } as const;

/** The lines, spots and patches of a mat: first all edges, then all beds, then all that is dark, so that roads that cross are one. */
export const roadMarks = once((mat: Mat): readonly Mark[] => {
  const { edge, bed, dark } = ROAD_COLOURS;
  const lines = listOf(mat, "line").map((road) => ({ way: wayOf(road), widthM: road.width_m ?? LINE_M }));
  const patches = listOf(mat, "patch").map(({ corners_m }) => corners_m);
  const spots = listOf(mat, "spot").map(({ centre_m, radius_m }) => ringOf(centre_m, radius_m, CORNERS));
  const areas = [...patches, ...spots];
  const roads = lines.filter(({ widthM }) => widthM <= WIDEST_M);
  return [
    ...areas.map((corners) => line(closedWay(corners), 2 * EDGE_M, edge)),
    ...lines.map(({ way, widthM }) => line(way, (widthM <= WIDEST_M ? ROAD_M : widthM) + 2 * EDGE_M, edge)),
    ...roads.map(({ way }) => line(way, ROAD_M, bed)),
    ...areas.map((corners) => area(corners, dark)),
    ...lines.map(({ way, widthM }) => line(way, widthM, dark)),
  ];
});

/** The floor, its pattern, what lies on it, and what stands on it. */
export interface Marks {
  ground: readonly Mark[];
  pattern: readonly Mark[];
  flat: readonly Mark[];
  things: readonly Thing[];
}

/** The pattern that was made last: each step of a drag comes here, and that of a hall has thousands of marks. */
let lastPattern: { look: string; marks: readonly Mark[] } = { look: "", marks: [] };

function patternOf(size: Point, floor: FloorName, gridColour: string, hasRoads: boolean): readonly Mark[] {
  const look = [size, floor, gridColour, hasRoads].join();
  if (look !== lastPattern.look) lastPattern = { look, marks: floorMarks(floor, size, gridColour, hasRoads) };
  return lastPattern.marks;
}

/** The marks of each mat as it was seen last. */
const known = new WeakMap<Mat, { floor: FloorName; theme: MatTheme; marks: Marks }>();

/** The marks of a mat with a floor, in the colours of a theme, which has that floor's own. */
export function marksOf(mat: Mat, floor: FloorName, theme: MatTheme): Marks {
  const last = known.get(mat);
  if (last?.floor === floor && last.theme === theme) return last.marks;
  const ground: Mark[] = [];
  const flat: Mark[] = [];
  let pattern: readonly Mark[] = [];
  const box = boxOfMat(mat);
  if (box && mat.size_m) {
    const corners = rectangle(box.left, box.bottom, box.right, box.top);
    ground.push(area(corners, theme.floor));
    pattern = patternOf(mat.size_m, floor, theme.grid, listOf(mat, "line").length > 0);
    if (mat.edge !== "wall") flat.push({ ...rim(corners, theme.edge), leastPx: EDGE_PX });
  }
  flat.push(...roadMarks(mat));
  for (const { centre_m, radius_m } of mat.voice ?? []) {
    if (!centre_m || !radius_m) continue;
    flat.push({ ...rim(ringOf(centre_m, radius_m, CORNERS), theme.accent), leastPx: EDGE_PX, alpha: 0.6 });
  }
  const marks = { ground, pattern, flat, things: [...edgeThings(mat, theme), ...thingsOn(mat, floor, theme)] };
  known.set(mat, { floor, theme, marks });
  return marks;
}
