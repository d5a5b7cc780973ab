import { describe, expect, it } from "vitest";
import type { PupilRow, WallWorld } from "../generated/classroom";
import { byNeed } from "./DeskPupils";
import { boxOf, decodeWall } from "./drawing";

// The first and the third world of list 5: one car, and none.
const GOLDEN =
  "05000000" +
  "0000 0100 e8030000" + // place 0, one car, at 1,000 ms
  "0000803f 00000040 0000003f" + // x: 1, y: 2, heading: 0.5
  "ffff 0e 04 02" + // no word, wheels, no LED, sends
  "000000" + // up to a multiple of four
  "0200 0000 d0070000"; // place 2, no car, at 2,000 ms

function bytesOf(hex: string): ArrayBuffer {
  const digits = hex.replaceAll(" ", "");
  return Uint8Array.from({ length: digits.length / 2 }, (_, k) => parseInt(digits.slice(2 * k, 2 * k + 2), 16)).buffer;
}

describe("a picture of the wall", () => {
  it("is decoded", () => {
    const picture = decodeWall(bytesOf(GOLDEN))!;
    expect(picture.number).toBe(5);
    expect([...picture.worlds.keys()]).toEqual([0, 2]);
    const { tMs, x, y, heading, led, flags } = picture.worlds.get(0)!;
    expect([tMs, x[0], y[0], heading[0], led[0], flags[0]]).toEqual([1000, 1, 2, 0.5, 4, 2]);
    expect(picture.worlds.get(2)).toMatchObject({ tMs: 2000, cars: 0 });
  });

  it("that is cut off is nothing, wherever the cut is within a world", () => {
    const bytes = bytesOf(GOLDEN);
    for (let length = 0; length < bytes.byteLength; length++) {
      const decoded = decodeWall(bytes.slice(0, length));
      const whole = [4, 32].includes(length);
      expect(decoded !== null).toBe(whole);
    }
  });
});

describe("what a small world shows", () => {
  const world = (mat: object): WallWorld => ({ pupil: "a", mat, leads: [0], radius_m: 0.07, cars: 1 }) as WallWorld;
  const cars = decodeWall(bytesOf(GOLDEN))!.worlds.get(0);

  it("is the whole mat where it has a size", () => {
    expect(boxOf(world({ size_m: [4, 3] }), cars, null)).toEqual({ left: 0, bottom: 0, right: 4, top: 3 });
  });

  it("is all cars where it has none, and never less than before", () => {
    const box = boxOf(world({}), cars, { left: -9, bottom: 0, right: 0, top: 0 });
    expect(box).toEqual({ left: -9, bottom: 0, right: 1.3, top: 2.3 });
  });
});

describe("the list of pupils", () => {
  const pupil = (name: string, what: Partial<PupilRow>): PupilRow => ({
    ...{ id: name, name, avatar: "bus", number: "0000", online: true, away_s: 0, hand_s: null, stuck_s: null },
    ...{ mission: null, goals_met: 0, goals: 0, stars: 0, wrong_numbers: 0 },
    ...what,
  });

  it("begins with who needs help, the longest waiting first, and ends with who is away", () => {
    const pupils = [
      pupil("away", { online: false }),
      pupil("works", {}),
      pupil("stuck", { stuck_s: 300 }),
      pupil("hand", { hand_s: 5 }),
      pupil("longer", { hand_s: 50 }),
    ];
    expect(byNeed(pupils).map(({ name }) => name)).toEqual(["longer", "hand", "stuck", "works", "away"]);
  });
});
