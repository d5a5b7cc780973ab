import { expect, it, vi } from "vitest";
import { Drawings, hasFastWebGl } from "./graphics";

interface Renderer {
  /** What the browser says that draws, and what it says when it is asked for more. */
  told?: string;
  unmasked?: string;
  lost?: boolean;
}

const RENDERER = 1;
const UNMASKED = 2;

/** Whether WebGL is found fast where each of its first drawings takes so many milliseconds, and how long the answer takes. */
function probed(drawsMs: number[], { told = "", unmasked = "", lost = false }: Renderer = {}): [boolean, number] {
  let now = 0;
  const pending = [...drawsMs];
  const last = pending.at(-1)!;
  const gl = new Proxy(
    {
      RENDERER,
      canvas: { width: 0, height: 0 },
      getParameter: (name: number) => (name === RENDERER ? told : unmasked),
      getExtension: (name: string) => (name === "WEBGL_debug_renderer_info" ? { UNMASKED_RENDERER_WEBGL: UNMASKED } : null),
      isContextLost: () => lost,
      readPixels: () => (now += pending.shift() ?? last),
    },
    { get: (own, name) => (name in own ? own[name as keyof typeof own] : () => 0) },
  );
  vi.spyOn(HTMLCanvasElement.prototype, "getContext").mockReturnValue(gl as never);
  return [hasFastWebGl(() => now), now];
}

it("WebGL is fast where a graphics processor draws, also when the first drawings waited for other work", () => {
  expect(probed([30, 2])).toEqual([true, 32]);
  expect(probed([30, 40, 2])).toEqual([true, 72]);
});

it("WebGL by the processor is found within 200 ms", () => {
  const [fast, ms] = probed([60, 45]);
  expect(fast).toBe(false);
  expect(ms).toBeLessThan(200);
});

it("a lost context draws nothing, however fast", () => {
  const [fast] = probed([0], { lost: true });
  expect(fast).toBe(false);
});

it("a program on the processor that the browser names isn't tried", () => {
  expect(probed([2], { told: "llvmpipe, or similar" })).toEqual([false, 0]);
  expect(probed([2], { told: "WebKit WebGL", unmasked: "ANGLE (Google, Vulkan 1.3.0 (SwiftShader Device (Subzero)))" })).toEqual([false, 0]);
  expect(probed([2, 2], { told: "WebKit WebGL", unmasked: "ANGLE (Intel, Mesa Intel(R) UHD Graphics 620)" })).toEqual([true, 4]);
});

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
