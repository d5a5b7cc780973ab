import { describe, expect, it } from "vitest";
import { boxOf, fitted, panned, scaleBar, toScreen, toWorld, zoomed } from "./camera";
import type { Mat } from "./document";
import { Motion } from "./carLayer";
import { gripAt, type Sight } from "./pointer";
import { pictureOf } from "./testPictures";

const SIZE = { width: 800, height: 600 };
const CAMERA = { x: 1, y: 2, scale: 100 };

it("screen and world are each other's way back, with y up", () => {
  expect(toWorld(CAMERA, SIZE, 500, 200)).toEqual([2, 3]);
  expect(toScreen(CAMERA, SIZE, [2, 3])).toEqual([500, 200]);
});

it("zooming keeps the point under the pointer", () => {
  const closer = zoomed(CAMERA, SIZE, 2, 500, 200);
  expect(closer.scale).toBe(200);
  expect(toWorld(closer, SIZE, 500, 200)).toEqual([2, 3]);
  expect(zoomed(CAMERA, SIZE, 1e9).scale).toBe(3000);
});

it("panning moves the plane with the hand", () => {
  expect(toScreen(panned(CAMERA, 30, -20), SIZE, [2, 3])).toEqual([530, 180]);
});

it("a fitted box is seen whole", () => {
  const camera = fitted({ left: 0, bottom: 0, right: 4, top: 3 }, SIZE);
  const [left, top] = toScreen(camera, SIZE, [0, 3]);
  expect(Math.min(left, top)).toBeGreaterThanOrEqual(0);
  expect(Math.min(left, top)).toBeLessThan(40);
});

it("a plane without end shows all that stands there", () => {
  const mat = { format: "motorcade-mat/1", name: "Plane", disc: [{ centre_m: [5, 5], radius_m: 1 }] } as const;
  const box = boxOf(mat, [-3], [1]);
  expect(box).toEqual({ left: -3.5, bottom: 0.5, right: 6.5, top: 5.5 });
});

it.each([
  [100, 1],
  [300, 0.2],
  [20, 5],
])("at %i pixels a metre the bar is %f m long", (scale, metres) => {
  const bar = scaleBar({ ...CAMERA, scale });
  expect(bar.metres).toBeCloseTo(metres);
  expect(bar.pixels).toBeCloseTo(metres * scale);
});

function motionOf(second: Parameters<typeof pictureOf>, gapMs = 33): Motion {
  const motion = new Motion();
  motion.take(pictureOf([{ x: 1, heading: 3.1 }]), 0);
  motion.take(pictureOf(...second), gapMs);
  return motion;
}

it("a car goes from one picture to the next, and turns the short way round", () => {
  const motion = motionOf([[{ x: 1.2, heading: -3.1 }]]);
  expect(motion.advance(33)).toBe(true);
  expect(motion.drawn.x[0]).toBeCloseTo(1);
  motion.advance(33 + 16.5);
  expect(motion.drawn.x[0]).toBeCloseTo(1.1);
  expect(Math.abs(motion.drawn.heading[0]!)).toBeCloseTo(Math.PI, 2);
  expect(motion.advance(66)).toBe(false);
  expect(motion.drawn.x[0]).toBeCloseTo(1.2);
});

it.each([
  ["was lifted", [[{ x: 5 }]]],
  ["is in the past", [[{ x: 1.2 }], { past: true }]],
  ["begins anew", [[{ x: 1.2 }], { fresh: true }]],
  ["has another crowd", [[{ x: 1.2 }, {}]]],
] as [string, Parameters<typeof pictureOf>][])("a picture is shown at once where it %s", (_, second) => {
  const motion = motionOf(second);
  motion.advance(33);
  expect(motion.drawn.x[0]).toBeCloseTo(second[0][0]!.x!);
});

it("the way back from the past is a leap", () => {
  const motion = motionOf([[{ x: 1.2 }], { past: true }]);
  motion.take(pictureOf([{ x: 1.4 }]), 66);
  motion.advance(66);
  expect(motion.drawn.x[0]).toBeCloseTo(1.4);
});

it("nothing is drawn before the first picture", () => {
  expect(new Motion().advance(0)).toBe(false);
});

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
