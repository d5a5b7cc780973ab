/** What pointer, keys and buttons do to cars and furniture. */

import { poseIn } from "../api/world";
import { say } from "../i18n";
import { notify } from "../state/dialogs";
import { record } from "../state/history";
import { useStudio } from "../state/studio";
import { RADIUS_M } from "./camera";
import { carsOf, MOST_ONE_BY_ONE, oneByOne, type CarPoses } from "./cars";
import { type Car, type FurnitureKind, listOf, type Mat, type PieceId, type Point, rounded } from "./document";
import { added, duplicated, moved, removed, reshaped } from "./edits";
import type { Grip } from "./pointer";
import { convoyOn, hasRoomForTile, REACH_M, roadOf, type Tile, TILES, turnedRoad, withRoad, withTile } from "./roads";
import { freePoint, hasRoomForCar, hasRoomForPiece, type Standing } from "./room";
import { session } from "./session";
import { choose, chosenCar, drawRoads, editMat, isFixed, useMat } from "./store";

export type NewKind = Exclude<FurnitureKind, "line"> | Tile | "leader" | "follower";
export const NEW_KINDS: readonly NewKind[] = ["leader", "follower", "wall", "disc", "polygon", "person", "spot", "patch", ...TILES];
const BESIDE_M = 0.25;

/** The document with each car written on its own, so that one of them can change; null where there are too many. */
function separate(): Mat | null {
  const { mat } = useStudio.getState();
  const { hello } = useMat.getState();
  if (!mat.crowd) return mat;
  const at = session.starts ?? session.picture;
  const { leaders, followers } = carsOf(mat);
  if (at?.x.length !== leaders + followers || at.x.length > MOST_ONE_BY_ONE) return null;
  return oneByOne(mat, at, new Set(hello?.leads));
}

function isBeginning(): boolean {
  return session.picture?.tMs === 0 && !session.picture.past;
}

/** Put a car elsewhere. At the beginning of a run that is its new start; later, a reset puts it back. */
function putCar(car: number, [x, y]: Point, headingDeg: number): void {
  if (isFixed()) return;
  const at_m: Point = [rounded(x), rounded(y)];
  const mat = isBeginning() ? separate() : null;
  const cars = mat?.car ?? [];
  const changed = mat && cars[car] ? { ...mat, car: cars.with(car, { ...cars[car], at_m, heading_deg: headingDeg }) } : null;
  session.move(car, { x_m: at_m[0], y_m: at_m[1], heading_deg: headingDeg }, changed);
  if (changed) editMat(changed, `car ${car}`);
}

function poseOf(car: number): { at: Point; headingDeg: number } | null {
  const pose = session.picture && poseIn(session.picture, car);
  return pose && { at: [pose.x_m, pose.y_m], headingDeg: pose.heading_deg };
}

export function moveBy(grip: Grip, dx: number, dy: number): void {
  if ("car" in grip) {
    const pose = poseOf(grip.car);
    if (pose) putCar(grip.car, [pose.at[0] + dx, pose.at[1] + dy], pose.headingDeg);
    return;
  }
  editMat(moved(useStudio.getState().mat, grip.piece, dx, dy), `move ${grip.piece.kind} ${grip.piece.place}`);
}

export function dragTo(grip: Grip, to: Point, by: Point): void {
  if ("car" in grip) {
    const pose = poseOf(grip.car);
    if (pose) putCar(grip.car, to, pose.headingDeg);
  } else if ("handle" in grip) {
    const { kind, place } = grip.piece;
    editMat(reshaped(useStudio.getState().mat, grip.piece, grip.handle, to), `shape ${kind} ${place} ${grip.handle}`);
  } else {
    moveBy(grip, ...by);
  }
}

const TURN_DEG = 15;

/** Turn a car a little to the left (1) or to the right (-1). */
export function turnCar(car: number, way: 1 | -1): void {
  const pose = poseOf(car);
  if (pose) putCar(car, pose.at, ((((pose.headingDeg + way * TURN_DEG + 180) % 360) + 360) % 360) - 180);
}

/** Change how far infrared reaches, in millimetres. */
export function setRange(rangeMm: number): void {
  if (isFixed()) return;
  const before = useStudio.getState().rangeMm;
  const show = (shown: number | null) => () => useStudio.setState({ rangeMm: shown });
  useStudio.setState({ rangeMm });
  record({ key: "range", undo: show(before), redo: show(rangeMm) });
}

/** Where the cars stand now and at the beginning. */
function standing(): Standing {
  const points = ({ x, y }: CarPoses) => Array.from(x, (each, k): Point => [each, y[k]!]);
  const cars = [session.picture, session.starts].flatMap((placed) => (placed ? points(placed) : []));
  return { cars, radiusM: useMat.getState().hello?.radius_m ?? RADIUS_M };
}

/** Put a new thing on the mat, at the nearest place with room for it. */
export function place(kind: NewKind, wished: Point): void {
  const { mat } = useStudio.getState();
  const now = standing();
  drawRoads(false);
  const isTile = (each: NewKind): each is Tile => (TILES as readonly NewKind[]).includes(each);
  if (isTile(kind)) {
    lay(withTile(mat, kind, freePoint(wished, (point) => hasRoomForTile(mat, point))));
    return;
  }
  if (kind !== "leader" && kind !== "follower") {
    const at = freePoint(wished, (point) => hasRoomForPiece(mat, now, kind, point));
    lay(added(mat, kind, at));
    return;
  }
  const at = freePoint(wished, (point) => hasRoomForCar(mat, now, point));
  addCar({ at_m: [rounded(at[0]), rounded(at[1])], ...(kind === "leader" && { role: "leader" }) });
}

function lay({ mat, id }: { mat: Mat; id: PieceId }): void {
  editMat(mat);
  choose({ piece: id });
}

/** Make a road of a stroke of mouse, pen or finger. */
export function drawRoad(stroke: readonly Point[]): void {
  const { mat } = useStudio.getState();
  const road = roadOf(mat, stroke);
  if (!road) return;
  lay(withRoad(mat, road, REACH_M));
}

export function turnRoad(id: PieceId): void {
  editMat(turnedRoad(useStudio.getState().mat, id));
}

/** Two cars behind each other don't touch. */
const CLEARANCE_M = 0.03;

/** Let all cars begin on a road, behind each other. */
export function putConvoy(id: PieceId): void {
  const mat = separate();
  const line = mat && listOf(mat, "line")[id.place];
  if (!mat?.car || !line) return;
  const { cars, left } = convoyOn(mat.car, line, 2 * (useMat.getState().hello?.radius_m ?? RADIUS_M) + CLEARANCE_M);
  editMat({ ...mat, car: cars });
  choose(null);
  drawRoads(false);
  if (left) notify(say("mat.convoyLeft", { count: left }));
}

function addCar(car: Car): void {
  const mat = separate() ?? useStudio.getState().mat;
  const cars = mat.car ?? [];
  editMat({ ...mat, car: [...cars, car] });
  choose({ car: cars.length });
}

export function removeChosen(): void {
  const { mat } = useStudio.getState();
  const { chosen } = useMat.getState();
  if (!chosen) return;
  if ("piece" in chosen) editMat(removed(mat, chosen.piece));
  else {
    const each = separate();
    if (!each) return;
    editMat({ ...each, car: (each.car ?? []).toSpliced(chosen.car, 1) });
  }
  choose(null);
}

export function duplicateChosen(): void {
  const { mat } = useStudio.getState();
  const { chosen } = useMat.getState();
  if (!chosen) return;
  if ("piece" in chosen) {
    const copy = duplicated(mat, chosen.piece);
    editMat(copy.mat);
    choose({ piece: copy.id });
    return;
  }
  const old = separate()?.car?.[chosen.car];
  if (!old) return;
  const now = standing();
  const [x, y] = freePoint([old.at_m[0] + BESIDE_M, old.at_m[1] - BESIDE_M], (point) => hasRoomForCar(mat, now, point));
  addCar({ ...old, at_m: [rounded(x), rounded(y)] });
}

/** Make the cars' present places their starts. */
export function startHere(): void {
  const { mat } = useStudio.getState();
  const { hello } = useMat.getState();
  const { picture } = session;
  if (!picture || picture.cars > MOST_ONE_BY_ONE) return;
  editMat(oneByOne(mat, picture, new Set(hello?.leads)));
}

/** Let a car tell its word, and why it does what it does. */
export function askWhy(car: number): void {
  choose({ car });
  useMat.setState({ asked: "story" });
}

/** The first tap lets a car tell its word, another shows the word's bits. */
export function tapCar(car: number): void {
  const { asked } = useMat.getState();
  if (asked && chosenCar() === car) toggleBits();
  else askWhy(car);
}

/** Let the car that was asked show the bits of its word, or tell it again. */
export const toggleBits = () => useMat.setState(({ asked }) => ({ asked: asked === "story" ? "bits" : "story" }));
