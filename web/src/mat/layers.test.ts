import { Graphics, Text, Texture } from "pixi.js";
import { expect, it, vi } from "vitest";
import { framed, isWellFramed, toScreen } from "./camera";
import { CarLayer, Motion } from "./carLayer";
import type { MatTheme } from "./colours";
import { FurnitureLayer, TrackLayer } from "./layers";
import { pictureOf } from "./testPictures";
import type { Textures } from "./textures";
import { ZoneLayer } from "./zoneLayer";

it("tracks stay when the stage is painted anew", () => {
  const tracks = new TrackLayer({ track: 0x112233 } as unknown as MatTheme);
  const at = (tMs: number, x: number) => tracks.take({ ...pictureOf([{}]), tMs, x: new Float32Array([x]) });
  [0, 0.1, 0.2].forEach((x, k) => at(100 * (k + 1), x));
  expect(tracks.view.children).toHaveLength(1);
  tracks.setTheme({ track: 0x445566 } as unknown as MatTheme);
  expect(tracks.view.children).toHaveLength(1);
  expect(tracks.view.tint).toBe(0x445566);
});

it("roads, spots and patches hide the floor below them", () => {
  const layer = new FurnitureLayer({} as Textures, {} as MatTheme);
  layer.setMat({ format: "motorcade-mat/1", name: "Town", line: [{ points_m: [[0, 0], [2, 2]] }], spot: [{ centre_m: [1, 1], radius_m: 0.2 }] }, null);
  layer.draw(1, 0);
  const painted = layer.floor.children.flatMap((each) => (each instanceof Graphics ? each.context.instructions : []));
  expect(painted.map(({ data }) => (data as { style: { alpha: number } }).style.alpha)).toEqual([1, 1, 1, 1, 1]);
});

it("the camera shows all cars of a mission, however small", () => {
  const size = { width: 800, height: 600 };
  const some = { x: [0.5, 10.1], y: [1, 1], carM: 0.15, first: 0 };
  const long = { ...some, all: true };
  const camera = framed(long, size)!;
  for (const x of long.x) {
    const [px] = toScreen(camera, size, [x, 1]);
    expect(px > 0 && px < size.width).toBe(true);
  }
  expect(isWellFramed(framed(some, size)!, long, size)).toBe(false);
});

it("zones' names have the page's font and stand at the upper edge, where no car waits", () => {
  document.body.style.fontFamily = "Page, serif";
  const zones = new ZoneLayer({ accent: 0x112233 } as unknown as MatTheme);
  zones.setZones([{ name: "a", title: { en: "Garage", zh: "车库" }, corners_m: [], centre_m: [1, 1], radius_m: 0.5 }]);
  zones.draw(1);
  const names = zones.view.children.flatMap(({ children }) => children).filter((each) => each instanceof Text);
  expect(names.map(({ text, style }) => [text, style.fontFamily])).toEqual([["Garage", "Page, serif"]]);
  expect(names.map(({ position, anchor }) => [position.x, position.y, anchor.y])).toEqual([[1000, 1496, 0]]);
});

it("all cars that a goal tells of are ringed, each once", () => {
  const textures = new Proxy({}, { get: (_, name) => (name === "wheels" ? [Texture.WHITE] : Texture.WHITE) }) as Textures;
  const cars = new CarLayer(textures, { accent: 0x112233, lost: 0x112233 } as unknown as MatTheme);
  const motion = new Motion();
  motion.take(pictureOf([{ x: 1 }, { x: 2 }, { x: 3 }]), 0);
  motion.advance(0);
  cars.setCars(3, new Set([0]), 0.075);
  cars.ringed = [2, 0, 2, 9];
  const circle = vi.spyOn(Graphics.prototype, "circle");
  cars.draw(motion.drawn, motion.picture, 0.1, 0);
  expect(circle.mock.calls.map(([x]) => x)).toEqual([3000, 1000]);
  circle.mockRestore();
});
