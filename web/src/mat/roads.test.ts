import { describe, expect, it } from "vitest";
import { type Car, type Line, type Mat, type Point } from "./document";
import { added, newPiece } from "./edits";
import { convoyOn, hasRoomForTile, REACH_M, roadOf, simplified, turnedRoad, withRoad, withTile } from "./roads";
import { roadMarks } from "./marks";
import { distanceToPiece, hasRoomForCar, hasRoomForPiece } from "./room";
import { alongWay, bandAlong, lengthOf, wayOf } from "./ways";

const EMPTY: Mat = { format: "motorcade-mat/1", name: "Table", size_m: [4, 3] };
const sum = (way: readonly Point[]) => way.reduce(([x, y], [px, py]): Point => [x + px, y + py], [0, 0]);

/** What path_of of motorcade/mats/model.py gives: the number of points, some of them, and the sum of all. */
it.each<[string, Line, number, Record<number, Point>, Point]>([
  ["sharp", { points_m: [[0, 0], [1, 0], [1, 1]] }, 3, {}, [2, 1]],
  ["round", { points_m: [[0, 0], [1, 0], [1, 1]], bend_m: 0.3 }, 19, { 1: [0.7, 0], 2: [0.729405, 0.001445], [17]: [1, 0.3] }, [16.10332, 2.89668]],
  ["closed", { points_m: [[0, 0], [1, 0], [1, 1], [0, 1]], bend_m: 0.25, closed: true }, 61, { 1: [0.001572, 0.222009], 60: [0, 0.25] }, [30, 30.25]],
  ["with near points", { points_m: [[0, 0], [0.2, 0], [0.2, 1], [0.5, 0.3]], bend_m: 0.3 }, 27, { 3: [0.134202, 0.006031] }, [6.13374, 10.74696]],
  ["there and back", { points_m: [[0, 0], [1, 0], [2, 0], [1, 0]], bend_m: 0.3 }, 4, {}, [4, 0]],
  ["a closed stretch", { points_m: [[0, 0], [0.5, 0]], bend_m: 0.3, closed: true }, 2, {}, [0.5, 0]],
])("a line goes where Python lets it go: %s", (_, line, count, some, total) => {
  const way = wayOf(line);
  expect(way).toHaveLength(count);
  for (const [at, [x, y]] of Object.entries(some)) expect(way[Number(at)]).toEqual([expect.closeTo(x, 5), expect.closeTo(y, 5)]);
  expect(sum(way)).toEqual([expect.closeTo(total[0], 4), expect.closeTo(total[1], 4)]);
});

it("a way has a length, a place and a direction at each of its metres", () => {
  const way: Point[] = [[0, 0], [1, 0], [1, 2]];
  expect(lengthOf(way)).toBe(3);
  expect(alongWay(way, 0.25)).toEqual({ at: [0.25, 0], headingDeg: 0 });
  expect(alongWay(way, 2)).toEqual({ at: [1, 1], headingDeg: 90 });
  expect(alongWay(way, 9).at).toEqual([1, 2]);
});

it("a band is as wide as it should be, in corners too", () => {
  expect(bandAlong([[0, 0], [1, 0], [1, 1]], 0.2).map(([x, y]) => [x.toFixed(2), y.toFixed(2)].join())).toEqual([
    "0.00,0.10", "0.90,0.10", "0.90,1.00", "1.10,1.00", "1.10,-0.10", "0.00,-0.10",
  ]);
});

describe("a road drawn by hand", () => {
  const round = (share: number) => Array.from({ length: 200 }, (_, k): Point => {
    const angle = 2 * Math.PI * share * (k / 199);
    return [2 + Math.cos(angle) + 0.01 * Math.sin(37 * k), 1.5 + Math.sin(angle) + 0.01 * Math.cos(53 * k)];
  });

  it("keeps few points, all within what a hand may miss", () => {
    const points = simplified(round(0.5), 0.05);
    expect(points.length).toBeLessThan(12);
    for (const at of round(0.5)) expect(distanceToPiece({ points_m: points }, at)).toBeLessThanOrEqual(0.05);
  });

  it("is closed where it ends near its beginning, and its bends are round enough to drive", () => {
    const road = roadOf(EMPTY, round(0.98))!;
    expect(road.closed).toBe(true);
    const way = wayOf(road);
    for (const at of round(0.9)) expect(distanceToPiece(road, at)).toBeLessThan(0.1);
    expect(lengthOf(way)).toBeCloseTo(2 * Math.PI, 0);
  });

  it("has few corners, since arcs follow a hand", () => {
    expect(roadOf(EMPTY, round(0.98))!.points_m.length).toBeLessThan(9);
    const wave = Array.from({ length: 150 }, (_, k): Point => [0.3 + (3.4 * k) / 149, 1.5 + 0.5 * Math.sin((4 * Math.PI * k) / 149) + 0.01 * Math.sin(37 * k)]);
    const road = roadOf(EMPTY, wave)!;
    expect(road.points_m.length).toBeLessThan(12);
    for (const at of wave) expect(distanceToPiece(road, at)).toBeLessThan(0.1);
  });

  it("stays open where it doesn't", () => {
    expect(roadOf(EMPTY, round(0.75))!.closed).toBeUndefined();
    expect(roadOf(EMPTY, [[1, 1], [1.5, 1], [1.1, 1]])?.closed).toBeUndefined();
  });

  it("is none where the hand hardly moved", () => {
    expect(roadOf(EMPTY, [[1, 1]])).toBeNull();
    expect(roadOf(EMPTY, [[1, 1], [1.01, 1], [1.02, 1.01]])).toBeNull();
  });

  it("stays on the mat, with room for a car", () => {
    expect(roadOf(EMPTY, [[-1, 1], [2, 1], [9, 2.99]])!.points_m).toEqual([[0.15, 1], [2, 1], [3.85, 2.85]]);
  });

  it("becomes one with the road at whose end it ends, and closed with both ends", () => {
    const first = withRoad(EMPTY, { points_m: [[1, 1], [2, 1]], bend_m: 0.25 }, REACH_M);
    const both = withRoad(first.mat, { points_m: [[3, 2], [3, 1], [2.1, 1.05]], bend_m: 0.25 }, REACH_M);
    expect(both.mat.line).toEqual([{ points_m: [[1, 1], [3, 1], [3, 2]], bend_m: 0.25 }]);
    const whole = withRoad(both.mat, { points_m: [[1.05, 1.05], [1, 2], [2.9, 2.05]], bend_m: 0.25 }, REACH_M);
    expect(whole.mat.line).toHaveLength(1);
    expect(whole.mat.line![0]).toMatchObject({ closed: true });
    expect(whole.mat.line![whole.id.place]!.points_m).toHaveLength(4);
  });

  it("leaves roads alone that it only crosses", () => {
    const first = withRoad(EMPTY, { points_m: [[1, 1], [3, 1]] }, REACH_M).mat;
    expect(withRoad(first, { points_m: [[2, 0.3], [2, 2]] }, REACH_M).mat.line).toHaveLength(2);
  });
});

describe("tiles", () => {
  it("lie in squares, and turn so that they meet the road", () => {
    const straight = withTile(EMPTY, "straight", [1.1, 1.4]).mat;
    expect(straight.line).toEqual([{ points_m: [[1, 1.25], [1.5, 1.25]], bend_m: 0.25 }]);
    const on = withTile(straight, "bend", [1.9, 1.3]).mat;
    expect(on.line).toHaveLength(1);
    expect(on.line![0]!.points_m).toHaveLength(3);
    const up = withTile(EMPTY, "bend", [0.7, 0.7]).mat;
    expect(withTile(up, "straight", [0.7, 0.2]).mat.line).toEqual([{ points_m: [[0.5, 0.75], [0.75, 0.75], [0.75, 0]], bend_m: 0.25 }]);
  });

  it("of four bends are a circle", () => {
    const squares: Point[] = [[1.2, 1.7], [1.2, 1.2], [1.7, 1.2], [1.7, 1.7]];
    // The first one's ends lead left and down: it is the upper right.
    const order = [squares[3]!, squares[0]!, squares[1]!, squares[2]!];
    const { mat } = order.reduce((laid, at) => withTile(laid.mat, "bend", at), withTile(EMPTY, "bend", order[0]!));
    expect(mat.line!.some(({ closed }) => closed)).toBe(true);
  });

  it("of a crossing are two lines, and the next one is laid beside", () => {
    const { mat } = withTile(EMPTY, "crossing", [1.1, 1.1]);
    expect(mat.line).toHaveLength(2);
    expect(hasRoomForTile(mat, [1.2, 1.2])).toBe(false);
    expect(hasRoomForTile(mat, [1.7, 1.2])).toBe(true);
    expect(hasRoomForTile(mat, [4.2, 1.2])).toBe(false);
  });

  it("turn by right angles, and four times are none", () => {
    const { mat, id } = withTile(EMPTY, "bend", [1.1, 1.1]);
    const once = turnedRoad(mat, id);
    expect(once).not.toEqual(mat);
    expect(turnedRoad(turnedRoad(turnedRoad(once, id), id), id)).toEqual(mat);
  });
});

describe("a convoy put on a road", () => {
  const cars: Car[] = [{ at_m: [0, 0] }, { at_m: [0, 1], role: "leader" }, { at_m: [0, 2] }];

  it("follows its leader, all with the road ahead", () => {
    const { cars: placed, left } = convoyOn(cars, { points_m: [[1, 1], [3, 1]] }, 0.18);
    expect(left).toBe(0);
    expect(placed).toEqual([
      { at_m: [1.4, 1], heading_deg: 0 },
      { at_m: [1.7, 1], heading_deg: 0, role: "leader" },
      { at_m: [1.1, 1], heading_deg: 0 },
    ]);
  });

  it("stands closer on a short road, and whoever has no room stays", () => {
    const short = convoyOn(cars, { points_m: [[1, 1], [1.6, 1]] }, 0.18).cars.map(({ at_m: [x] }) => x);
    expect(short).toEqual([1.3, 1.5, 1.1]);
    const { cars: placed, left } = convoyOn(cars, { points_m: [[1, 1], [1.4, 1]] }, 0.18);
    expect(left).toBe(1);
    expect(placed[2]).toEqual(cars[2]);
  });

  it("goes round a closed road without meeting its own end", () => {
    const many: Car[] = Array.from({ length: 12 }, () => ({ at_m: [0, 0] }));
    const { cars: placed, left } = convoyOn(many, { points_m: [[1, 1], [2, 1], [2, 2], [1, 2]], closed: true }, 0.18);
    expect(left).toBe(0);
    const gaps = placed.map(({ at_m: [x, y] }, k) => Math.hypot(x - placed[(k + 1) % 12]!.at_m[0], y - placed[(k + 1) % 12]!.at_m[1]));
    expect(Math.min(...gaps)).toBeGreaterThan(0.18);
  });
});

it("what is flat is in nobody's way", () => {
  const nobody = { cars: [[2, 1.5]] as Point[], radiusM: 0.075 };
  for (const kind of ["line", "spot", "patch"] as const) {
    const { mat } = added(EMPTY, kind, [2, 1.5]);
    expect(hasRoomForCar(mat, { cars: [], radiusM: 0.075 }, [2, 1.5])).toBe(true);
    expect(hasRoomForPiece(EMPTY, nobody, kind, [2, 1.5])).toBe(true);
  }
  expect(hasRoomForPiece(EMPTY, nobody, "disc", [2, 1.5])).toBe(false);
});

it("roads are painted edges first and lines last, and a broad line has no bed", () => {
  const thin = newPiece("line", [1, 1]) as Line;
  const mat: Mat = { ...EMPTY, line: [thin, { ...thin, width_m: 0.3 }], spot: [{ centre_m: [3, 2], radius_m: 0.2 }] };
  expect(roadMarks(mat).map(({ widthM }) => Number(widthM.toFixed(3)))).toEqual([0.04, 0.24, 0.34, 0.2, 0, 0.03, 0.3]);
});
