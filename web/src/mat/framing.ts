/** How the stage's camera moves: what it frames, how it zooms and pans, and the scale beside it. */

import { around, type Box, boxAround, boxOfMat, boxOfPoints, type Camera, FEW_CARS, grown, type Size, toScreen, toWorld } from "./camera";
import { handlesOf, listOf, type Mat, piecesOf } from "./document";

const LEAST_SCALE = 0.2;
const MOST_SCALE = 3000;
/** What lies over the edges of the stage: caption, buttons, and the bar that plays. */
const OVER_PX = { left: 16, right: 60, top: 48, bottom: 76 };
/** The air around the cars, in metres. */
const AIR_M = 0.3;
const ZONE_AIR_M = 0.15;
/** A mat that takes little more room than what is to be seen is seen whole: so much smaller it is drawn then at most. */
const WHOLE_MAT_SHARE = 0.8;
/** The camera comes no nearer than this: so long a car is then. */
const LONGEST_PX = 90;
/** All of them are in view for as long as one would be so long as it is: they are more than the leader in the middle. */
const FARTHEST_PX = 4;
/** Roads are seen whole for as long as one would be so long. */
const ROADS_PX = 10;

/** The point under the pointer stays under it. */
export function zoomed(camera: Camera, size: Size, factor: number, px = size.width / 2, py = size.height / 2): Camera {
  const scale = Math.min(MOST_SCALE, Math.max(LEAST_SCALE, camera.scale * factor));
  const [x, y] = toWorld(camera, size, px, py);
  const share = camera.scale / scale;
  return { x: x + (camera.x - x) * share, y: y + (camera.y - y) * share, scale };
}

export function panned(camera: Camera, dxPx: number, dyPx: number): Camera {
  return { ...camera, x: camera.x - dxPx / camera.scale, y: camera.y + dyPx / camera.scale };
}

/** The box as large as it can be seen whole beside what lies over the stage. */
export function fitted(box: Box, size: Size, mostScale = MOST_SCALE): Camera {
  const { left, right, top, bottom } = OVER_PX;
  const width = Math.max(40, size.width - left - right);
  const height = Math.max(40, size.height - top - bottom);
  const scale = Math.min(width / Math.max(0.05, box.right - box.left), height / Math.max(0.05, box.top - box.bottom), mostScale);
  return {
    x: (box.left + box.right + (right - left) / scale) / 2,
    y: (box.bottom + box.top + (top - bottom) / scale) / 2,
    scale,
  };
}

export interface Cast {
  x: ArrayLike<number>;
  y: ArrayLike<number>;
  /** How long a car is, in metres. */
  carM: number;
  /** The car to keep in view where the others are too far from each other. */
  first: number;
  /** What should be seen too, unless it is too far away. */
  zones?: readonly Box[];
  /** The roads, which are seen whole where the cars are large enough then. */
  roads?: Box | null;
  /** The mat, where it has a size. */
  mat?: Box | null;
  /** All cars are seen, however small: goals are about all of them. */
  all?: boolean;
}

/** The cars with air around them and, where all fit, the zones, the roads, and the mat; null without cars. */
function boxToFrame({ x, y, carM, zones = [], roads, mat }: Cast, size: Size): Box | null {
  const cars = boxAround(x, y);
  if (!cars) return null;
  const told = around([grown(cars, AIR_M), ...zones.map((each) => grown(each, ZONE_AIR_M))])!;
  if (fitted(told, size).scale < FARTHEST_PX / carM) return grown(cars, AIR_M);
  const driven = roads ? around([told, grown(roads, ZONE_AIR_M)])! : told;
  const all = fitted(driven, size).scale < ROADS_PX / carM ? told : driven;
  const { scale } = fitted(all, size);
  const whole = mat && around([cars, ...zones, mat]);
  return whole && fitted(whole, size).scale >= WHOLE_MAT_SHARE * scale ? whole : all;
}

/** Frame all cars with air around them; where they are too far from each other, the first one in the middle. */
export function framed(cast: Cast, size: Size): Camera | null {
  const { x, y, carM, first, all = false } = cast;
  const box = boxToFrame(cast, size);
  if (!box) return null;
  const camera = fitted(box, size, LONGEST_PX / carM);
  const least = FARTHEST_PX / carM;
  if (all || x.length > FEW_CARS || camera.scale >= least) return camera;
  const [cx, cy] = [x[first] ?? x[0]!, y[first] ?? y[0]!];
  return fitted({ left: cx, right: cx, bottom: cy, top: cy }, size, least);
}

/** Whether what is to be seen is framed well enough for the camera to rest: all in view, and neither lost in it nor tiny. */
export function isWellFramed(camera: Camera, cast: Cast, size: Size): boolean {
  const air = boxToFrame(cast, size);
  const wished = framed(cast, size);
  if (!air || !wished) return true;
  const ratio = wished.scale / camera.scale;
  if (ratio < 0.7 || ratio > 1.5) return false;
  const box = grown(air, cast.carM - AIR_M);
  const [left, top] = toScreen(camera, size, [box.left, box.top]);
  const [right, bottom] = toScreen(camera, size, [box.right, box.bottom]);
  const isWhole = left >= 0 && top >= 0 && right <= size.width && bottom <= size.height - OVER_PX.bottom / 2;
  return isWhole || (!cast.all && wished.scale <= FARTHEST_PX / cast.carM + 1 && Math.hypot(wished.x - camera.x, wished.y - camera.y) * camera.scale < 60);
}

/** On the way from one camera to another; the scale changes evenly to the eye. */
export function between(from: Camera, to: Camera, share: number): Camera {
  return {
    x: from.x + (to.x - from.x) * share,
    y: from.y + (to.y - from.y) * share,
    scale: from.scale * (to.scale / from.scale) ** share,
  };
}

/** Whether nobody can tell the two apart. */
export function isSame(a: Camera, b: Camera): boolean {
  return Math.hypot(a.x - b.x, a.y - b.y) * a.scale < 0.5 && Math.abs(a.scale / b.scale - 1) < 0.002;
}

/** The box around the mat; on an unbounded plane, around all cars and furniture. */
export function boxOf(mat: Mat, x: ArrayLike<number>, y: ArrayLike<number>): Box {
  const sized = boxOfMat(mat);
  if (sized) return sized;
  const points = piecesOf(mat).flatMap(({ piece }) => handlesOf(piece));
  for (let k = 0; k < x.length; k++) points.push([x[k]!, y[k]!]);
  const box = boxOfPoints(points);
  return box ? grown(box, 0.5) : { left: -2, bottom: -1.5, right: 2, top: 1.5 };
}

/** The box around the lines on the floor; null where there are none. */
export function boxOfRoads(mat: Mat): Box | null {
  return boxOfPoints(listOf(mat, "line").flatMap(({ points_m }) => points_m));
}

/** A round length whose bar is about `wishedPx` long. */
export function scaleBar(camera: Camera, wishedPx = 110): { metres: number; pixels: number } {
  const wished = wishedPx / camera.scale;
  const power = 10 ** Math.floor(Math.log10(wished));
  const metres = [5, 2, 1].map((each) => each * power).find((each) => each <= wished * 1.0001) ?? power;
  return { metres, pixels: metres * camera.scale };
}
