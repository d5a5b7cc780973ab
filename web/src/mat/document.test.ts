import { describe, expect, it } from "vitest";
import * as edit from "./document";
import type { FurnitureKind, Mat } from "./document";

const EMPTY: Mat = { format: "motorcade-mat/1", name: "Table", size_m: [4, 3], edge: "wall" };

function furnished(): Mat {
  return edit.FURNITURE.reduce((mat, kind) => edit.added(mat, kind, [1, 2]).mat, EMPTY);
}

describe("furniture", () => {
  it.each(edit.FURNITURE)("%s: is added, moved, duplicated, removed, and the old document stays", (kind: FurnitureKind) => {
    const { mat, id } = edit.added(EMPTY, kind, [1, 2]);
    expect(EMPTY).not.toHaveProperty(kind);
    const handles = edit.handlesOf(kind, edit.pieceOf(mat, id)!);
    const movedOn = edit.moved(mat, id, 0.5, -1);
    expect(edit.handlesOf(kind, edit.pieceOf(movedOn, id)!)).toEqual(
      handles.map(([x, y]) => [edit.rounded(x + 0.5), edit.rounded(y - 1)]),
    );
    const copy = edit.duplicated(mat, id);
    expect(copy.id).toEqual({ kind, place: 1 });
    expect(edit.pieceOf(copy.mat, copy.id)).not.toEqual(edit.pieceOf(mat, id));
    expect(edit.removed(copy.mat, copy.id)).toEqual(mat);
    expect(edit.removed(mat, id)).toEqual(EMPTY);
  });

  it.each([
    ["wall", 1, [3, 3], { from_m: [0.6, 2], to_m: [3, 3] }],
    ["disc", 0, [1, 2.5], { centre_m: [1, 2], radius_m: 0.5 }],
    ["disc", 0, [1, 2], { centre_m: [1, 2], radius_m: 0.02 }],
  ] as const)("a %s is reshaped by its handle %i", (kind, handle, point, expected) => {
    const { mat, id } = edit.added(EMPTY, kind, [1, 2]);
    expect(edit.pieceOf(edit.reshaped(mat, id, handle, point), id)).toEqual(expected);
  });

  it("of one kind leaves the others alone", () => {
    const mat = edit.moved(furnished(), { kind: "disc", place: 0 }, 1, 1);
    expect(mat.wall).toEqual(furnished().wall);
    expect(mat.disc).toEqual([{ centre_m: [2, 3], radius_m: 0.15 }]);
  });
});

it.each([
  [0, [0, 0]],
  [1500, [1.5, 0]],
  [3000, [2, 1]],
  [5000, [1, 0]],
])("a person who walks is at %i ms where the mat's document says", (tMs, expected) => {
  const path = [
    [0, 0, 0],
    [2, 2, 0],
    [4, 2, 2],
  ] as const;
  expect(edit.personAt({ path, repeats: true }, tMs)).toEqual(expected);
  if (tMs >= 4000) expect(edit.personAt({ path }, tMs)).toEqual([2, 2]);
});

it.each([0, 0.05, 0.5, 0.95])("a loss of %f is found again", (share) => {
  const mat = edit.withLoss({ ...EMPTY, physics: { collisions: false } }, share);
  expect(edit.lossOf(mat)).toBeCloseTo(share, 3);
  expect(mat.physics?.collisions).toBe(false);
  expect("bit_error_rate" in mat.physics!).toBe(share > 0);
});
