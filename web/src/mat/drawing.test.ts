import { describe, expect, it } from "vitest";
import { shortestPx, toScreen, toWorld } from "./camera";
import { between, boxOf, fitted, framed, isWellFramed, panned, scaleBar, zoomed } from "./framing";
import { boxAt, discAt, touchesMat } from "../missions/draft";
import type { Mat, Point } from "./document";
import { Motion } from "./motion";
import { gripAt, type OnStage } from "./pointer";
import { carBeside, freePoint, hasRoomForCar, hasRoomForPiece } from "./room";
import { eyeBehind, paintOrder, seen } from "./behind";
import { heardIn, starNotes } from "./sound";
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
  expect(Math.min(left, top)).toBeLessThan(60);
});

describe("the camera", () => {
  const cast = (x: number[], y: number[]) => ({ x, y, carM: 0.15, first: 0 });
  const carPx = (x: number[], y: number[]) => framed(cast(x, y), SIZE)!.scale * 0.15;

  it("frames cars with air around them, at most 90 pixels long", () => {
    expect(carPx([2], [1])).toBeCloseTo(90);
    const camera = framed(cast([1, 3], [1, 2]), SIZE)!;
    for (const [x, y] of [[1, 1], [3, 2]] as const) {
      const [px, py] = toScreen(camera, SIZE, [x, y]);
      expect(px).toBeGreaterThan(40);
      expect(px).toBeLessThan(SIZE.width - 60);
      expect(py).toBeGreaterThan(40);
      expect(py).toBeLessThan(SIZE.height - 76);
    }
  });

  it("has all cars in view before the leader is in the middle, and paints none of few shorter than 24 pixels", () => {
    const camera = framed(cast([0, 20], [0, 0]), SIZE)!;
    for (const x of [0, 20]) {
      const [px] = toScreen(camera, SIZE, [x, 0]);
      expect(px > 0 && px < SIZE.width).toBe(true);
    }
    const [px, py] = toScreen(framed(cast([0, 100], [0, 0]), SIZE)!, SIZE, [0, 0]);
    expect(px > 0 && px < SIZE.width && py > 0 && py < SIZE.height).toBe(true);
    expect([13, 200, 201].map(shortestPx)).toEqual([24, 24, 9]);
  });

  it("rests while it shows the cars well, and goes where they leave the view or gather", () => {
    const camera = framed(cast([0, 2], [0, 1]), SIZE)!;
    expect(isWellFramed(camera, cast([0.1, 2.1], [0, 1]), SIZE)).toBe(true);
    expect(isWellFramed(camera, cast([0, 3], [0, 1]), SIZE)).toBe(false);
    expect(isWellFramed(camera, cast([1, 1.2], [0.5, 0.5]), SIZE)).toBe(false);
  });

  it("shows a mission's zones too, unless its cars would be tiny then", () => {
    const zone = { left: 2, bottom: 0, right: 3, top: 1 };
    const camera = framed({ ...cast([0], [0]), zones: [zone] }, SIZE)!;
    const [px] = toScreen(camera, SIZE, [zone.right, zone.top]);
    expect(px).toBeLessThan(SIZE.width - 60);
    expect(isWellFramed(framed(cast([0], [0]), SIZE)!, { ...cast([0], [0]), zones: [zone] }, SIZE)).toBe(false);
    const far = framed({ ...cast([0], [0]), zones: [{ ...zone, right: 500 }] }, SIZE)!;
    expect(far.scale * 0.15).toBeCloseTo(90);
    expect(toScreen(framed({ ...cast([0], [0]), zones: [{ ...zone, right: 6 }] }, SIZE)!, SIZE, [6, 1])[0]).toBeLessThan(SIZE.width);
  });
  it("shows roads whole where the cars are large enough then", () => {
    const leftOf = (right: number) => toScreen(framed({ ...cast([1], [1]), roads: { left: 0, right, bottom: 0, top: 2 } }, SIZE)!, SIZE, [0, 0])[0];
    expect([leftOf(4) > 0, leftOf(40) > 0]).toEqual([true, false]);
  });

  it("shows a mat whole that takes little more room than its cars", () => {
    const mat = (width: number) => ({ left: 0, bottom: 0, right: width, top: 2 });
    const leftOf = (right: number) => toScreen(framed({ ...cast([1, 3], [1, 1]), mat: mat(right) }, SIZE)!, SIZE, [0, 0])[0];
    expect(leftOf(3.2)).toBeGreaterThan(0);
    expect(leftOf(9)).toBeLessThan(0);
  });

  it("goes from one view to another evenly", () => {
    expect(between({ x: 0, y: 0, scale: 100 }, { x: 2, y: 4, scale: 400 }, 0.5)).toEqual({ x: 1, y: 2, scale: 200 });
  });
});

it("the first car that stands beside its mat is named", () => {
  const beside = (...car: [number, number][]) => carBeside({ format: "motorcade-mat/1", name: "", size_m: [2, 1], car: car.map((at_m) => ({ at_m })) });
  expect(beside([0, 0], [2, 1])).toBeNull();
  expect(beside([1, 1], [50, 0.5], [0, -9])).toBe(1);
  expect(carBeside({ format: "motorcade-mat/1", name: "", car: [{ at_m: [900, 0] }] })).toBeNull();
});

it("a zone of which a part lies on the mat is on it", () => {
  const touches = (x: number, y: number) => [boxAt("home", x, y), discAt("home", x, y)].map((zone) => touchesMat({ size_m: [2, 1] } as unknown as Mat, zone));
  expect(touches(1, 0.5)).toEqual([true, true]);
  expect(touches(-0.1, 1.1)).toEqual([true, true]);
  for (const [x, y] of [[-0.5, 0.5], [2.5, 0.5], [1, -0.5], [1, 30]] as const) expect(touches(x, y)).toEqual([false, false]);
});

describe("room", () => {
  const mat: Mat = { format: "motorcade-mat/1", name: "Table", size_m: [4, 3], wall: [{ from_m: [0, 2], to_m: [4, 2] }] };
  const standing = { cars: [[2, 1.5]] as [number, number][], radiusM: 0.075 };

  it("is beside the car that stands where a wall was wished", () => {
    const at = freePoint([2, 1.5], (point) => hasRoomForPiece(mat, standing, "wall", point));
    expect(Math.abs(at[1] - 1.5)).toBeGreaterThanOrEqual(0.125);
    expect(Math.hypot(at[0] - 2, at[1] - 1.5)).toBeLessThan(0.7);
  });

  it.each([
    ["on another car", [2, 1.5], false],
    ["in a wall", [1, 2], false],
    ["outside", [4, 1], false],
    ["on free floor", [1, 1], true],
  ] as const)("for a car %s: %s %s", (_, at, expected) => {
    expect(hasRoomForCar(mat, standing, at)).toBe(expected);
  });

  it("is where it was wished if nothing is free", () => {
    expect(freePoint([1, 1], () => false)).toEqual([1, 1]);
  });
});

it("motors, a leader's frame and a new light are heard, and no others", () => {
  const before = pictureOf([{ led: 4 }, { led: 2 }]);
  const events = Uint32Array.of(0, 0, 3, 0, 0);
  expect(heardIn(pictureOf([{ wheels: 3, led: 1 }, { led: 2 }], { events }), before, new Set([0]))).toEqual({ motors: 0.5, ticks: true, chime: 1 });
  expect(heardIn(pictureOf([{}, { led: 2 }], { events }), before, new Set([1]))).toEqual({ motors: 0, ticks: false, chime: null });
  expect(heardIn(pictureOf([{ led: 1 }, {}], { fresh: true }), before, new Set()).chime).toBeNull();
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
  polygon: [{ corners_m: [[3, 0], [4, 0], [4, 1], [3, 1]] }],
  person: [{ path: [[0, 0, 5], [10, 1, 5]] }],
};
const CARS = { x: Float32Array.of(1, 1.1), y: Float32Array.of(1, 1), heading: Float32Array.of(0, 0) };
const SIGHT: OnStage = { mat: MAT, drawn: CARS, radiusM: 0.075, chosen: null, tMs: 5000 };

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
    const sight: OnStage = { ...SIGHT, drawn: { ...CARS, x: Float32Array.of(2, 2), y: Float32Array.of(0, 0) }, chosen: { piece } };
    expect(gripAt(sight, [2, 0], 0.05)).toEqual({ piece, handle: 1 });
  });
});

describe("the view from behind a car", () => {
  const eye = eyeBehind(2, 1, Math.PI / 2);
  const horizon = SIZE.height * 0.32;
  const spot = (x: number, y: number, z = 0) => seen(eye, SIZE, [[x, y, z]], false)[0]!;

  it("has its car in the middle, what is left of it on the left, what is higher above, what is farther nearer to the horizon", () => {
    const [x, y] = spot(2, 1);
    expect(x).toBeCloseTo(SIZE.width / 2);
    expect(y).toBeGreaterThan(horizon);
    expect(y).toBeLessThan(SIZE.height - 76);
    expect(spot(1.8, 1)[0]).toBeLessThan(x);
    expect(spot(2.2, 1)[0]).toBeGreaterThan(x);
    expect(spot(2, 1, 0.1)[1]).toBeLessThan(y);
    expect(spot(2, 5)[1]).toBeLessThan(y);
    expect(spot(2, 1000)[1]).toBeCloseTo(horizon, 0);
  });

  it("draws nothing that is behind", () => {
    expect(seen(eye, SIZE, [[1.9, 0, 0], [2.1, 0, 0], [2, -1, 0]])).toEqual([]);
  });

  it("paints a car before the wall that hides it and after the wall that it hides, wherever the wall's middle is", () => {
    const order = (wall: [Point, Point], at: Point) => {
      const painted: string[] = [];
      const middle: Point = [(wall[0][0] + wall[1][0]) / 2, (wall[0][1] + wall[1][1]) / 2];
      const solids = [
        { at: middle, footprint: wall, paint: () => painted.push("wall") },
        { at, footprint: null, paint: () => painted.push("car") },
      ];
      for (const { paint } of paintOrder(eye, solids)) paint();
      return painted.join(" ");
    };
    // The wall goes from near on the left to far on the right.
    const wall: [Point, Point] = [[1.5, 1.2], [3, 4]];
    expect(order(wall, [1.6, 2])).toBe("car wall");
    expect(order(wall, [2.3, 2.65])).toBe("wall car");
    expect(order(wall, [2, 9])).toBe("car wall");
  });

  it("cuts a shape off where it reaches behind the camera, and keeps its outline whole", () => {
    const floor = seen(eye, SIZE, [[0, 0, 0], [4, 0, 0], [4, 3, 0], [0, 3, 0]]);
    expect(floor).toHaveLength(4);
    expect(floor.flat().every(Number.isFinite)).toBe(true);
    const line = seen(eye, SIZE, [[2, -5, 0], [2, 3, 0]], false);
    expect(line).toHaveLength(2);
    expect(line[0]![1]).toBeGreaterThan(SIZE.height);
  });
});

it("stars sound one note each, rising; all three have a fourth", () => {
  expect([0, 1, 2, 3].map((stars) => starNotes(stars).length)).toEqual([0, 1, 2, 4]);
  expect([...starNotes(3)]).toEqual([...starNotes(3)].sort((a, b) => a - b));
});
