import { describe, expect, it } from "vitest";
import * as cars from "./cars";
import { type FurnitureKind, type Mat, type PieceId, FURNITURE, drivesLike, floorOf, handlesOf, lossOf, personAt, pieceOf, rounded } from "./document";
import * as edit from "./edits";
import { canLose, changed, retimed, withoutPoint, withPointAfter } from "./edits";

const EMPTY: Mat = { format: "motorcade-mat/1", name: "Table", size_m: [4, 3], edge: "wall" };

function full(): Mat {
  return FURNITURE.reduce((mat, kind) => edit.added(mat, kind, [1, 2]).mat, EMPTY);
}

describe("furniture", () => {
  it.each(FURNITURE)("%s: is added, moved, duplicated, removed, and the old document stays", (kind: FurnitureKind) => {
    const { mat, id } = edit.added(EMPTY, kind, [1, 2]);
    expect(EMPTY).not.toHaveProperty(kind);
    const handles = handlesOf(pieceOf(mat, id)!);
    const movedOn = edit.moved(mat, id, 0.5, -1);
    expect(handlesOf(pieceOf(movedOn, id)!)).toEqual(
      handles.map(([x, y]) => [rounded(x + 0.5), rounded(y - 1)]),
    );
    const copy = edit.duplicated(mat, id);
    expect(copy.id).toEqual({ kind, place: 1 });
    expect(pieceOf(copy.mat, copy.id)).not.toEqual(pieceOf(mat, id));
    expect(edit.removed(copy.mat, copy.id)).toEqual(mat);
    expect(edit.removed(mat, id)).toEqual(EMPTY);
  });

  it.each([
    ["wall", 1, [3, 3], { from_m: [0.6, 2], to_m: [3, 3] }],
    ["disc", 0, [1, 2.5], { centre_m: [1, 2], radius_m: 0.5 }],
    ["disc", 0, [1, 2], { centre_m: [1, 2], radius_m: 0.02 }],
  ] as const)("a %s is reshaped by its handle %i", (kind, handle, point, expected) => {
    const { mat, id } = edit.added(EMPTY, kind, [1, 2]);
    expect(pieceOf(edit.reshaped(mat, id, handle, point), id)).toEqual(expected);
  });

  it("of one kind leaves the others alone", () => {
    const mat = edit.moved(full(), { kind: "disc", place: 0 }, 1, 1);
    expect(mat.wall).toEqual(full().wall);
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
  expect(personAt({ path, repeats: true }, tMs)).toEqual(expected);
  if (tMs >= 4000) expect(personAt({ path }, tMs)).toEqual([2, 2]);
});

it.each([0, 0.05, 0.5, 0.95])("a loss of %f is found again", (share) => {
  const mat = edit.withLoss({ ...EMPTY, physics: { collisions: false } }, share);
  expect(lossOf(mat)).toBeCloseTo(share, 3);
  expect(mat.physics?.collisions).toBe(false);
  expect("bit_error_rate" in mat.physics!).toBe(share > 0);
});

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

it("a road goes on in its direction at its end, unless it is closed", () => {
  const road = { points_m: [[0, 0], [1, 0]] } as const;
  const last = (closed: boolean) => withPointAfter({ ...MAT, line: [{ ...road, closed }] }, { kind: "line", place: 0 }, 1).line![0]!.points_m.at(-1);
  expect([last(false), last(true)]).toEqual([[1.5, 0], [0.5, 0]]);
});

it("a path without its first point begins at 0 s again", () => {
  expect(pathOf(withoutPoint(MAT, WALKER, 0))).toEqual([[0, 1, 0], [4, 0, 0]]);
});

it("no piece loses a point that it needs", () => {
  const lost = [canLose(WALKER, 1), canLose(WALKER, 2), canLose(BOX, 3), canLose({ kind: "wall", place: 0 }, 2)];
  expect(lost).toEqual([false, true, false, false]);
});

it("a point's new time takes along those behind it, and times always rise", () => {
  expect(pathOf(retimed(MAT, WALKER, 1, 6)).map(([t]) => t)).toEqual([0, 6, 10]);
  expect(pathOf(retimed(MAT, WALKER, 2, 1)).map(([t]) => t)).toEqual([0, 4, 4.1]);
  expect(pathOf(retimed(MAT, WALKER, 0, 5))).toEqual(pathOf(MAT));
});

it("a walk is repeated or not", () => expect(changed(MAT, WALKER, { repeats: false }).person![0]!.repeats).toBe(false));

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

it("only what cars begin with needs a new world", () => {
  expect(cars.beginning({ ...TABLE, wall: [{ from_m: [0, 0], to_m: [1, 1] }] })).toBe(cars.beginning(TABLE));
  expect(cars.beginning(cars.withFollowers(TABLE, 3))).not.toBe(cars.beginning(TABLE));
});

it("the slider reaches 0, each small number, and 1,000", () => {
  const reached = new Set(Array.from({ length: cars.SLIDER_STEPS + 1 }, (_, position) => cars.followersAt(position)));
  for (const each of [0, 1, 2, 3, 5, 10, 1000]) expect(reached).toContain(each);
  for (const each of [0, 1, 500, 1000]) expect(cars.followersAt(cars.positionOf(each))).toBeGreaterThanOrEqual(each);
});

it("a mat drives alike on every floor; a new one is a wooden table", () => {
  expect(floorOf(EMPTY)).toBe("table");
  expect(floorOf({ ...EMPTY, floor: "moon" })).toBe("moon");
  expect(drivesLike(EMPTY, { ...EMPTY, floor: "moon" })).toBe(true);
  expect(drivesLike(EMPTY, { ...EMPTY, floor: "moon", edge: "open" })).toBe(false);
  expect(cars.beginning({ ...EMPTY, floor: "moon" })).toBe(cars.beginning(EMPTY));
});
