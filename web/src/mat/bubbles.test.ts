import { expect, it } from "vitest";
import { freePlace } from "./bubbles";
import { nudgeOf } from "./pointer";

it("a bubble stands above its car, or below it where a zone's name is above, or nowhere", () => {
  const box = (y: number) => ({ x: 100, y, width: 80, height: 20 }) as DOMRect;
  const [above, below] = [box(50), box(120)];
  expect(freePlace([above, below], [])).toBe(above);
  expect(freePlace([above, below], [box(72)])).toBe(below);
  expect(freePlace([above, below], [box(75)])).toBe(above);
  expect(freePlace([above, below], [box(72), box(110)])).toBeUndefined();
});

it("an arrow key moves what is chosen, less with Shift", () => {
  const nudge = (key: string, shiftKey = false) => nudgeOf({ key, shiftKey });
  expect(nudge("ArrowUp")).toEqual([0, 0.05]);
  expect(nudge("ArrowLeft", true)).toEqual([-0.01, 0]);
  expect(nudge("Enter")).toBeNull();
});
