import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import { eyeBehind, paintBehind } from "./behind";
import { toScreen } from "./camera";
import { framed, isWellFramed } from "./framing";
import { CarLooks } from "./carLooks";
import type { Mat } from "./document";
import { Motion } from "./motion";
import { marksOf } from "./marks";
import { paint, type View, viewOf } from "./painter";
import { type Painted, testContext, watchCanvases } from "./testCanvas";
import { pictureOf } from "./testPictures";
import { Tracks } from "./tracks";

const SIZE = { width: 400, height: 300 };
const CAMERA = { x: 1, y: 1, scale: 100 };
let sprites: Painted[];

beforeEach(() => {
  sprites = watchCanvases();
});
afterEach(() => {
  vi.restoreAllMocks();
});

const TOWN: Mat = {
  format: "motorcade-mat/1",
  name: "Town",
  size_m: [3, 2],
  line: [{ points_m: [[0, 0], [2, 2]] }],
  spot: [{ centre_m: [1, 1], radius_m: 0.2 }],
  wall: [{ from_m: [0.5, 1.5], to_m: [1.5, 1.5] }],
  disc: [{ centre_m: [2, 0.5], radius_m: 0.2 }],
  polygon: [{ corners_m: [[2, 1], [2.5, 1], [2.5, 1.5], [2, 1.5]] }],
};

/** A view of cars side by side, the first of which leads. */
function viewWith(cars: number, mat: Mat = TOWN): { view: View; looks: CarLooks } {
  const looks = new CarLooks();
  const motion = new Motion();
  motion.take(pictureOf(Array.from({ length: cars }, (_, k) => ({ x: 0.5 + 0.4 * k, y: 1 }))), 0);
  motion.advance(0);
  looks.setCars(cars, new Set([0]), 0.075);
  looks.advance(motion.drawn, 0, false);
  return { view: { ...viewOf(mat), cars: looks.looks }, looks };
}

it.each(["table", "classroom", "city", "night", "moon", "plain"] as const)("the outlines of all things are closed on the floor '%s', and end where cars bump", (floor) => {
  const { things } = marksOf({ ...TOWN, floor }, floor, viewOf({ ...TOWN, floor }).theme);
  const house = things[0]!;
  const rims = house.marks.filter(({ leastPx }) => leastPx === 2);
  expect(rims.length).toBeGreaterThan(0);
  for (const { way } of rims) expect(way[0]).toEqual(way.at(-1));
  expect(rims[0]!.way.slice(0, -1)).toEqual(house.footprint);
});

it("what lies and stands on a floor hides it, and higher things cover lower ones", () => {
  const painted: Painted[] = [];
  paint(testContext(SIZE.width, SIZE.height, painted), { ...viewOf(TOWN) }, CAMERA);
  const areas = sprites.filter(({ what }) => what === "fill" || what === "stroke");
  expect(areas.length).toBeGreaterThan(8);
  for (const { alpha } of areas) expect(alpha).toBeGreaterThan(0);
  const high = marksOf(TOWN, "table", viewOf(TOWN).theme).things.flatMap(({ marks }) => marks.map(({ highM = 0 }) => highM));
  expect(Math.max(...high)).toBeGreaterThan(0.1);
});

it("the floor is painted once for as long as it and the camera stay, and lines of tracks come onto it", () => {
  const context = testContext(SIZE.width, SIZE.height);
  const tracks = new Tracks();
  const view = { ...viewOf(TOWN), tracks };
  const fills = () => sprites.filter(({ what }) => what === "fill").length;
  const at = (tMs: number, x: number) => tracks.take({ ...pictureOf([{}]), tMs, x: new Float32Array([x]) });
  at(100, 0);
  paint(context, view, CAMERA);
  const before = fills();
  expect(before).toBeGreaterThan(0);
  at(200, 0.1);
  paint(context, view, CAMERA);
  expect(fills()).toBe(before);
  expect(sprites.at(-1)).toMatchObject({ what: "stroke", colour: view.theme.track });
  expect(sprites.at(-1)!.path.flat().map((value) => Math.round(value * 100) / 100)).toEqual([0, 0, 0.1, 0]);
  paint(context, view, { ...CAMERA, x: 2 });
  expect(fills()).toBeGreaterThan(before);
});

it("tracks are painted again after the camera moved, in the colour of the theme", () => {
  const tracks = new Tracks();
  const at = (tMs: number, x: number) => tracks.take({ ...pictureOf([{}]), tMs, x: new Float32Array([x]) });
  [0, 0.1, 0.2].forEach((x, k) => at(100 * (k + 1), x));
  const context = testContext(SIZE.width, SIZE.height);
  const { theme } = viewOf(null);
  paint(context, { ...viewOf(null), tracks }, CAMERA);
  paint(context, { ...viewOf(null), tracks, theme: { ...theme, track: "#445566" } }, CAMERA);
  const strokes = sprites.filter(({ what, colour }) => what === "stroke" && colour === "#445566");
  expect(strokes.map(({ path }) => path.length)).toEqual([3]);
});

it("the camera shows all cars of a mission, however small", () => {
  const size = { width: 800, height: 600 };
  const some = { x: [0.5, 60.1], y: [1, 1], carM: 0.15, first: 0 };
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
  const zone = { name: "a", title: { en: "Garage", zh: "车库" }, corners_m: [], centre_m: [1, 1], radius_m: 0.5, avoid: false };
  paint(testContext(SIZE.width, SIZE.height), { ...viewOf(null), zones: [{ zone, name: "Garage", fits: false }] }, CAMERA);
  expect(sprites.filter(({ what }) => what === "fillText").map(({ args }) => args)).toEqual([["Garage", 200, 104]]);
});

it("no zone's name lies over another", () => {
  const zones = ["A", "B", "C"].map((name, k) => ({
    zone: { name, title: { en: name, zh: name }, corners_m: [], centre_m: [1 + 0.06 * k, 1], radius_m: 0.5, avoid: false },
    name,
    fits: false,
  }));
  paint(testContext(SIZE.width, SIZE.height), { ...viewOf(null), zones }, CAMERA);
  expect(sprites.filter(({ what }) => what === "fillText").map(({ args }) => args[0])).toEqual(["A", "C"]);
});

it("all cars that a goal tells of are ringed, each once", () => {
  const painted: Painted[] = [];
  const { view } = viewWith(3);
  paint(testContext(SIZE.width, SIZE.height, painted), { ...view, ringed: new Set([2, 0, 2, 9]) }, CAMERA);
  const rings = painted.filter(({ what, colour }) => what === "stroke" && colour === view.theme.accent);
  expect(rings.map(({ path }) => Math.round(path[0]![0]))).toEqual([150, 230]);
});

it("each car is put together of sprites, turned to where it drives; many cars are one sprite each", () => {
  const sizes = [3, 300].map((cars) => {
    const painted: Painted[] = [];
    const { view } = viewWith(cars, { format: "motorcade-mat/1", name: "Plane" });
    view.cars.forEach((look) => Object.assign(look, { x: 1, y: 1, heading: 0.5 }));
    paint(testContext(SIZE.width, SIZE.height, painted), view, CAMERA);
    const drawn = painted.filter(({ what, transform }) => what === "drawImage" && Math.abs(transform[0]! - Math.cos(0.5)) < 1e-6);
    return drawn.length / cars;
  });
  // A shadow, two wheels and a body.
  expect(sizes).toEqual([4, 1]);
});

it("a car that lost a message shows a sign for half a second, and one that heard one blinks", () => {
  const { looks } = viewWith(2);
  const motion = new Motion();
  motion.take(pictureOf([{}, {}]), 0);
  motion.advance(0);
  looks.lose(1, true, 1000);
  looks.hear(0, 1000);
  expect(looks.advance(motion.drawn, 1100, false)).toBe(true);
  expect(looks.looks.map(({ blinks, loss }) => [blinks, loss?.sign])).toEqual([[true, undefined], [false, "collision"]]);
  expect(looks.advance(motion.drawn, 1600, false)).toBe(false);
  expect(looks.looks.every(({ blinks, loss }) => !blinks && loss === null)).toBe(true);
});

describe("the view from behind a car", () => {
  it("draws the mat's own marks, and sees through what would hide its car", () => {
    const paintedFor = (mat: Mat) => {
      const painted: Painted[] = [];
      const { view } = viewWith(1, mat);
      paintBehind(testContext(SIZE.width, SIZE.height, painted), view, eyeBehind(0.5, 1, 0), SIZE);
      return painted.filter(({ what }) => what === "fill");
    };
    const colours = new Set(paintedFor(TOWN).map(({ colour }) => colour));
    expect(colours).toContain("#17181c");
    expect(colours).toContain("#c4473a");
    const hidden = { ...TOWN, polygon: [{ corners_m: [[0, 0.8], [0.2, 0.8], [0.2, 1.2], [0, 1.2]] as [number, number][] }] };
    const sheer = (mat: Mat) => paintedFor(mat).filter(({ colour, alpha }) => colour === "#c4473a" && alpha < 0.3).length;
    expect(sheer(TOWN)).toBe(0);
    expect(sheer(hidden)).toBeGreaterThan(0);
  });
});
