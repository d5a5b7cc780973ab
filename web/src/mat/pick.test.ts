import { describe, expect, it } from "vitest";
import type { Mat } from "./document";
import { gripAt, type Sight } from "./pick";

const MAT: Mat = {
  format: "motorcade-mat/1",
  name: "Table",
  wall: [{ from_m: [0, 0], to_m: [2, 0] }],
  disc: [{ centre_m: [5, 5], radius_m: 0.5 }],
  polygon: [
    {
      corners_m: [
        [3, 0],
        [4, 0],
        [4, 1],
        [3, 1],
      ],
    },
  ],
  person: [
    {
      path: [
        [0, 0, 5],
        [10, 1, 5],
      ],
    },
  ],
};
const CARS = { x: Float32Array.of(1, 1.1), y: Float32Array.of(1, 1), heading: Float32Array.of(0, 0) };
const SIGHT: Sight = { mat: MAT, drawn: CARS, radiusM: 0.075, chosen: null, tMs: 5000 };

describe("the pointer finds", () => {
  it.each([
    ["the nearer car", [1.06, 1], { car: 1 }],
    ["a wall from beside it", [1, 0.04], { piece: { kind: "wall", place: 0 } }],
    ["a disc", [5.3, 5.3], { piece: { kind: "disc", place: 0 } }],
    ["a box from within", [3.5, 0.5], { piece: { kind: "polygon", place: 0 } }],
    ["a person where they are now", [0.5, 5.1], { piece: { kind: "person", place: 0 } }],
    ["nothing where nothing is", [9, 9], null],
    ["nothing where a person was", [0, 5], null],
  ] as const)("%s", (_, point, expected) => {
    expect(gripAt(SIGHT, point, 0.05)).toEqual(expected);
  });

  it("a chosen piece's handles before all else", () => {
    const piece = { kind: "wall", place: 0 } as const;
    const sight: Sight = { ...SIGHT, drawn: { ...CARS, x: Float32Array.of(2, 2), y: Float32Array.of(0, 0) }, chosen: { piece } };
    expect(gripAt(sight, [2, 0], 0.05)).toEqual({ piece, handle: 1 });
  });
});
