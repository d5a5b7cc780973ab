import { expect, it } from "vitest";
import { stationAt, wayAlong } from "./road";

it.each([2, 3, 4])("each station is beside or below the one before, with %i in a row", (columns) => {
  const places = Array.from({ length: 8 }, (_, place) => stationAt(place, columns));
  places.slice(1).forEach(({ column, row }, k) => {
    const before = places[k]!;
    expect(Math.abs(column - before.column) + (row - before.row)).toBe(1);
    expect(column).toBeGreaterThanOrEqual(0);
    expect(column).toBeLessThan(columns);
  });
});

it("the road leads through the middle of each station", () => {
  expect(wayAlong(3, 2)).toBe("M0.5 0.5L1.5 0.5C2.12 0.5 2.12 1.5 1.5 1.5");
});
