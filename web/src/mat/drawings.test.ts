import { expect, it, vi } from "vitest";
import { Drawings } from "./drawings";
import { Scene } from "./scene";
import { watchCanvases } from "./testCanvas";

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

it("a computer that slept during a drawing draws on soon", () => {
  vi.useFakeTimers({ toFake: ["setTimeout", "clearTimeout", "requestAnimationFrame", "cancelAnimationFrame", "performance"] });
  let [count, slept] = [0, 0];
  const drawings = new Drawings(() => (count += 1), () => performance.now() + slept);
  drawings.request();
  vi.advanceTimersToNextFrame();
  slept = 8 * 3_600_000;
  vi.advanceTimersByTime(1);
  drawings.request();
  vi.advanceTimersByTime(1500);
  expect(count).toBe(2);
  vi.useRealTimers();
});

it("a stage that gets another size is painted before the browser shows it", () => {
  const painted = watchCanvases();
  const host = document.createElement("div");
  const resize = (width: number) => Object.defineProperties(host, { clientWidth: { value: width, configurable: true }, clientHeight: { value: 150, configurable: true } });
  let changed: () => void = vi.fn();
  vi.stubGlobal("ResizeObserver", class { constructor(act: () => void) { changed = act; } observe = vi.fn(); disconnect = vi.fn(); });
  vi.stubGlobal("requestAnimationFrame", vi.fn());
  resize(300);
  const scene = new Scene(host, { onCamera: vi.fn(), onDrawn: vi.fn(), onHeld: vi.fn() });
  painted.length = 0;
  resize(400);
  changed();
  expect(painted.map(({ what }) => what)).toContain("drawImage");
  scene.destroy();
  vi.unstubAllGlobals();
  vi.restoreAllMocks();
});
