/** A mat document: its pieces, their points, and what the page asks of them. */

import { FLAT, type FloorName, type Mat, type Person, type Point, SHAPES } from "../generated/world";

export { FLOOR_NAMES } from "../generated/world";
export type { Car, Crowd, FloorName, Line, Mat, Person, Point, Voice } from "../generated/world";

export type FurnitureKind = keyof typeof SHAPES;
type Pieces = { [K in FurnitureKind]: NonNullable<Mat[K]>[number] };
export type Piece = Pieces[FurnitureKind];

/** The lowest first: cars drive over what is flat. */
export const FURNITURE = Object.keys(SHAPES) as readonly FurnitureKind[];

/** Whether a kind of piece is a mark on the floor, in nobody's way. */
export function isFlat(kind: FurnitureKind): boolean {
  return (FLAT as readonly FurnitureKind[]).includes(kind);
}

/** A piece of furniture by its place in the document's list. */
export interface PieceId {
  kind: FurnitureKind;
  place: number;
}

export function listOf<K extends FurnitureKind>(mat: Mat, kind: K): readonly Pieces[K][] {
  return (mat[kind] as readonly Pieces[K][] | undefined) ?? [];
}

export function floorOf(mat: Mat | null): FloorName {
  return mat?.floor ?? "table";
}

/** Whether two mats are the same to drive on, whatever they look like. */
export function drivesLike(a: Mat, b: Mat): boolean {
  return JSON.stringify({ ...a, floor: undefined }) === JSON.stringify({ ...b, floor: undefined });
}

/** All pieces, the lowest first. */
export function piecesOf(mat: Mat): { id: PieceId; piece: Piece }[] {
  return FURNITURE.flatMap((kind) => listOf(mat, kind).map((piece, place) => ({ id: { kind, place }, piece })));
}

export function pieceOf(mat: Mat, id: PieceId): Piece | undefined {
  return listOf(mat, id.kind)[id.place];
}

export function without<T extends object>(whole: T, ...keys: (keyof T)[]): T {
  const rest = { ...whole };
  for (const key of keys) Reflect.deleteProperty(rest, key);
  return rest;
}

/** Round metres to whole millimetres. */
export function rounded(metres: number): number {
  return Math.round(metres * 1000) / 1000;
}

/** The points that make a piece; of a round one its centre. */
export function pointsOf(piece: Piece): readonly Point[] {
  if ("path" in piece) return piece.path.map(([, x, y]): Point => [x, y]);
  if ("from_m" in piece) return [piece.from_m, piece.to_m];
  if ("centre_m" in piece) return [piece.centre_m];
  return "corners_m" in piece ? piece.corners_m : piece.points_m;
}

/** The points of a piece that can be dragged; a round one has one, on its rim. */
export function handlesOf(piece: Piece): readonly Point[] {
  return "centre_m" in piece ? [[piece.centre_m[0] + piece.radius_m, piece.centre_m[1]]] : pointsOf(piece);
}

/** Where a person is at a moment, as docs/mats.md says. */
export function personAt({ path, repeats }: Person, tMs: number): Point {
  const last = path.at(-1)!;
  const whole = last[0];
  let t = tMs / 1000;
  if (repeats && whole > 0) t %= whole;
  const next = path.findIndex(([at]) => at > t);
  if (next < 0) return [last[1], last[2]];
  const [t1, x1, y1] = path[next]!;
  const [t0, x0, y0] = path[Math.max(0, next - 1)]!;
  const share = t1 > t0 ? (t - t0) / (t1 - t0) : 1;
  return [x0 + (x1 - x0) * share, y0 + (y1 - y0) * share];
}

/** The share of frames that flipped bits destroy on the way to one receiver; a frame has 32 bits. */
export function lossOf(mat: Mat): number {
  return 1 - (1 - (mat.physics?.bit_error_rate ?? 0)) ** 32;
}
