import { expect, it } from "vitest";
import { boxOf, fitted, panned, scaleBar, toScreen, toWorld, zoomed } from "./camera";

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
