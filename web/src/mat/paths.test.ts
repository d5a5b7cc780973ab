import { expect, it } from "vitest";
import type { Mat, PieceId } from "./document";
import { canLose, retimed, withoutPoint, withPointAfter, withRepeats } from "./paths";

const WALKER: PieceId = { kind: "person", place: 0 };
const BOX: PieceId = { kind: "polygon", place: 0 };
const MAT: Mat = {
  format: "motorcade-mat/1",
  name: "m",
  person: [{ path: [[0, 0, 0], [4, 1, 0], [8, 0, 0]], repeats: true }],
  polygon: [{ corners_m: [[0, 0], [1, 0], [1, 1]] }],
};
const pathOf = (mat: Mat) => mat.person![0]!.path;

it("a path gets a point halfway to the next, and one farther on at its end", () => {
  expect(pathOf(withPointAfter(MAT, WALKER, 0))).toEqual([[0, 0, 0], [2, 0.5, 0], [4, 1, 0], [8, 0, 0]]);
  expect(pathOf(withPointAfter(MAT, WALKER, 2)).at(-1)).toEqual([10, 0.5, 0]);
});

it("a box gets a corner, behind its last one too", () => {
  expect(withPointAfter(MAT, BOX, 2).polygon![0]!.corners_m).toEqual([[0, 0], [1, 0], [1, 1], [0.5, 0.5]]);
});

it("a path without its first point begins at 0 s again", () => {
  expect(pathOf(withoutPoint(MAT, WALKER, 0))).toEqual([[0, 1, 0], [4, 0, 0]]);
});

it("no piece loses a point that it needs", () => {
  expect([canLose(WALKER, 1), canLose(WALKER, 2), canLose(BOX, 3), canLose({ kind: "wall", place: 0 }, 2)]).toEqual([
    false,
    true,
    false,
    false,
  ]);
});

it("a point's new time takes along those behind it, and times always rise", () => {
  expect(pathOf(retimed(MAT, WALKER, 1, 6)).map(([t]) => t)).toEqual([0, 6, 10]);
  expect(pathOf(retimed(MAT, WALKER, 2, 1)).map(([t]) => t)).toEqual([0, 4, 4.1]);
  expect(pathOf(retimed(MAT, WALKER, 0, 5))).toEqual(pathOf(MAT));
});

it("a walk is repeated or not", () => expect(withRepeats(MAT, WALKER, false).person![0]!.repeats).toBe(false));
