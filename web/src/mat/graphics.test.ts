import { expect, it, vi } from "vitest";
import { hasFastWebGl } from "./graphics";

/** Whether WebGL is found fast where each of its first drawings takes so many milliseconds, and how long the answer takes. */
function probed(drawsMs: number[], lost = false): [boolean, number] {
  let now = 0;
  const pending = [...drawsMs];
  const last = pending.at(-1)!;
  const gl = new Proxy(
    { canvas: { width: 0, height: 0 }, getExtension: () => null, isContextLost: () => lost, readPixels: () => (now += pending.shift() ?? last) },
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
  const [fast] = probed([0], true);
  expect(fast).toBe(false);
});
