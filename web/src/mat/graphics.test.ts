import { afterEach, expect, it, vi } from "vitest";
import { Pace } from "./graphics";
import { ZoneLayer } from "./zoneLayer";
import type { MatTheme } from "./colours";
import type { Container, Text } from "pixi.js";

afterEach(() => vi.useRealTimers());

/** How often a stage that always wants the next picture is drawn in a second, where a browser shows one in so many ms. */
function drawnInASecond(pictureMs: number): number {
  vi.useFakeTimers({ toFake: ["setTimeout", "clearTimeout", "performance"] });
  vi.stubGlobal("requestAnimationFrame", (then: () => void) => setTimeout(then, pictureMs));
  vi.stubGlobal("cancelAnimationFrame", clearTimeout);
  let drawn = 0;
  const pace = new Pace(() => {
    drawn++;
    pace.request();
  });
  pace.request();
  vi.advanceTimersByTime(10_000);
  pace.stop();
  vi.unstubAllGlobals();
  return drawn / 10;
}

it("each picture of a fast browser is drawn, and a slow one gets half of its time for the rest of the page", () => {
  expect(drawnInASecond(20)).toBeGreaterThan(48);
  const slow = drawnInASecond(200);
  expect(slow).toBeGreaterThan(1.5);
  expect(slow).toBeLessThan(2.5);
});

it("many wishes make one drawing, and none is made without a wish", () => {
  vi.useFakeTimers({ toFake: ["requestAnimationFrame", "cancelAnimationFrame", "performance"] });
  const draw = vi.fn();
  const pace = new Pace(draw);
  pace.request();
  pace.request();
  vi.advanceTimersByTime(1000);
  expect(draw).toHaveBeenCalledTimes(1);
});

it("the titles of zones are in the page's font", () => {
  const layer = new ZoneLayer({ accent: 0 } as unknown as MatTheme);
  layer.setZones([{ name: "a", title: { en: "A" }, corners_m: [], centre_m: [1, 1], radius_m: 1 }]);
  layer.draw(1);
  const [title] = (layer.view.children[1] as Container<Text>).children;
  expect(title!.style.fontFamily).toMatch(/^system-ui/);
});
