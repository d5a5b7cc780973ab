import { expect, it, vi } from "vitest";
import { Drawings } from "./drawings";

/** How many pictures are drawn in 10 s where the browser paints each for so long. */
function picturesIn10s(paintsMs: number): number {
  vi.useFakeTimers({ toFake: ["setTimeout", "clearTimeout", "requestAnimationFrame", "cancelAnimationFrame", "performance"] });
  let [count, painted] = [0, 0];
  const now = () => performance.now() + painted;
  const drawings = new Drawings(() => {
    count += 1;
    drawings.request();
    painted += paintsMs;
  }, now);
  const begun = now();
  drawings.request();
  while (now() - begun < 10_000) vi.advanceTimersByTime(1);
  drawings.stop();
  vi.useRealTimers();
  return count;
}

it("a page that is painted slowly rests for as long as it paints", () => {
  expect(picturesIn10s(10)).toBeGreaterThan(300);
  expect(picturesIn10s(450)).toBeLessThan(13);
  expect(picturesIn10s(450)).toBeGreaterThan(6);
});
