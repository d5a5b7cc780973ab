import { describe, expect, it } from "vitest";
import * as cars from "./cars";
import type { Mat } from "./document";

const TABLE: Mat = {
  format: "motorcade-mat/1",
  name: "Table",
  size_m: [4, 3],
  car: [{ at_m: [2, 1.5], role: "leader" }, { at_m: [1, 1] }, { at_m: [3, 1] }],
  crowd: [{ cars: 5, leaders: 1, corner_m: [0.4, 0.4], size_m: [1.2, 2.2], spacing_m: 0.4 }],
};

describe("the number of followers", () => {
  it.each([0, 1, 2, 5, 6, 7, 15, 40, 300, 1000])("becomes %i, and no leader is lost", (wished) => {
    expect(cars.carsOf(cars.withFollowers(TABLE, wished))).toEqual({ leaders: 2, followers: wished });
  });

  it("falls at the cost of crowds before cars that somebody placed", () => {
    expect(cars.withFollowers(TABLE, 3).car).toEqual(TABLE.car);
    expect(cars.withFollowers(TABLE, 1).car).toEqual(TABLE.car!.slice(0, 2));
  });

  it("rises within the crowd's area where there is room, else all over the mat", () => {
    expect(cars.withFollowers(TABLE, 10).crowd![0]).toMatchObject({ cars: 9, corner_m: [0.4, 0.4] });
    expect(cars.withFollowers(TABLE, 40).crowd![0]).not.toHaveProperty("corner_m");
    expect(cars.withFollowers(TABLE, 40).size_m).toEqual(TABLE.size_m);
  });

  it("lets the mat grow around its middle where cars would touch", () => {
    const grown = cars.withFollowers(TABLE, 1000);
    const [width, height] = grown.size_m!;
    expect(grown.crowd![0]!.spacing_m).toBe(0.2);
    expect(width * height).toBeGreaterThan(1000 * 0.2 ** 2);
    expect(grown.car![0]!.at_m).toEqual([width / 2, height / 2].map((each) => expect.closeTo(each, 3) as number));
  });

  it("stands around the first car on a plane without end", () => {
    const plane: Mat = { format: "motorcade-mat/1", name: "Plane", car: [{ at_m: [9, 9], role: "leader" }] };
    const [crowd] = cars.withFollowers(plane, 50).crowd!;
    expect(crowd!.corner_m![0] + crowd!.size_m![0] / 2).toBeCloseTo(9, 2);
  });
});

it("cars written down one by one keep numbers, places and roles", () => {
  const placed = { x: [0.1234, 2, 3], y: [1, 2, 3], heading: [0, Math.PI / 2, -Math.PI] };
  const mat = cars.oneByOne(TABLE, placed, new Set([1]));
  expect(mat).not.toHaveProperty("crowd");
  expect(mat.car).toEqual([
    { at_m: [0.123, 1] },
    { at_m: [2, 2], heading_deg: 90, role: "leader" },
    { at_m: [3, 3], heading_deg: -180 },
  ]);
});

it("a car is added, changed and removed", () => {
  const { mat, number } = cars.addedCar(TABLE, { at_m: [0, 0] });
  expect(mat.car![number]).toEqual({ at_m: [0, 0] });
  expect(cars.withCar(mat, number, { at_m: [1, 0] }).car![number]).toEqual({ at_m: [1, 0] });
  expect(cars.removedCar(mat, number)).toEqual(TABLE);
});

it("only what cars begin with needs a new world", () => {
  expect(cars.beginning({ ...TABLE, wall: [{ from_m: [0, 0], to_m: [1, 1] }] })).toBe(cars.beginning(TABLE));
  expect(cars.beginning(cars.withFollowers(TABLE, 3))).not.toBe(cars.beginning(TABLE));
});

it("the slider reaches 0, each small number, and 1,000", () => {
  const reached = new Set(Array.from({ length: cars.SLIDER_STEPS + 1 }, (_, position) => cars.followersAt(position)));
  for (const each of [0, 1, 2, 3, 5, 10, 1000]) expect(reached).toContain(each);
  for (const each of [0, 1, 500, 1000]) expect(cars.followersAt(cars.positionOf(each))).toBeGreaterThanOrEqual(each);
});
