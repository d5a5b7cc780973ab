import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import texts from "virtual:texts/class";
import type { PupilRow, WallWorld } from "../generated/classroom";
import { ClassStream } from "./ask";
import { byNeed } from "./TeacherPupils";
import { changeLanguage, startTexts } from "../i18n";
import { bytesOf } from "../api/testStream";
import { type Painted, testContext, watchCanvases } from "../mat/testCanvas";
import { boxOf, columnsFor, decodeWall, drawWorld, Tiles } from "./drawing";
import { secretOf } from "./secret";

await startTexts(texts);

// The first and the third world of list 5: one car, and none.
const GOLDEN =
  "05000000" +
  "0000 0100 e8030000" + // place 0, one car, at 1,000 ms
  "0000803f 00000040 0000003f" + // x: 1, y: 2, heading: 0.5
  "ffff 0e 04 02" + // no word, wheels, no LED, sends
  "000000" + // up to a multiple of four
  "0200 0000 d0070000"; // place 2, no car, at 2,000 ms

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

describe("the tiles of the wall", () => {
  const cars = decodeWall(bytesOf(GOLDEN))!.worlds.get(0)!;

  it("draw what came before they were there, until another list comes", () => {
    const [tiles, drawn] = [new Tiles(), vi.fn()];
    tiles.show("mia", cars);
    tiles.ready("mia", drawn);
    expect(drawn.mock.calls).toEqual([[cars]]);
    tiles.show("mia", cars);
    tiles.show("ben", cars);
    expect(drawn).toHaveBeenCalledTimes(2);
    tiles.ready("mia", null);
    tiles.show("mia", cars);
    tiles.forget();
    tiles.ready("mia", drawn);
    expect(drawn).toHaveBeenCalledTimes(2);
  });
});

describe("what a small world shows", () => {
  const world = (mat: object): WallWorld => ({ pupil: "a", mat, leads: [0], radius_m: 0.07, cars: 1, zones: [], goals: [] }) as WallWorld;
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
    ...{ mission: null, goals_met: 0, goals: 0, stars: 0 },
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

describe("what stands behind '#'", () => {
  it("is the code of the class where it can be one, else a shared link", () => {
    expect(secretOf("/join", "HQ6FCA")).toBe("HQ6FCA");
    for (const link of ["", "p=HQ6", "project=fY27", "HQ6FCAX", "HQ6FC", "HQ 6FC", "%20HQ6F"]) expect(secretOf("/join", link)).toBe("");
    expect(secretOf("/teacher", "a-key_of-the-teacher")).toBe("a-key_of-the-teacher");
    expect(secretOf("/wall", "a-key")).toBe("");
  });
});

describe("the columns of the wall", () => {
  const heightOf = (tiles: number, columns: number, width: number) =>
    Math.ceil(tiles / columns) * ((width - 10 * (columns - 1)) / columns / 1.5 + 40);

  it("make the tiles as large as all of them fit", () => {
    for (const [tiles, width, height] of [
      [1, 1334, 700],
      [2, 1334, 700],
      [9, 1408, 820],
      [30, 1334, 690],
    ] as const) {
      const columns = columnsFor(tiles, width, height);
      expect(heightOf(tiles, columns, width)).toBeLessThan(height);
      if (columns > 1) expect(heightOf(tiles, columns - 1, width) + 10 * Math.ceil(tiles / (columns - 1))).toBeGreaterThan(height);
    }
  });

  it("leave room for a car on a small page, which scrolls", () => {
    expect(columnsFor(30, 358, 700)).toBe(2);
    expect(columnsFor(120, 1334, 690)).toBe(8);
  });
});

describe("a stream", () => {
  class Socket extends EventTarget {
    static readonly OPEN = 1;
    static opened: Socket[] = [];
    closed = false;
    constructor() {
      super();
      Socket.opened.push(this);
    }
    receive(data: string) {
      this.dispatchEvent(new MessageEvent("message", { data }));
    }
    close() {
      this.closed = true;
      this.dispatchEvent(new Event("close"));
    }
  }
  const links: boolean[] = [];
  let stream: ClassStream<{ is: string; code?: string }>;
  const wake = () => window.dispatchEvent(new Event("online"));

  beforeEach(() => {
    vi.useFakeTimers();
    vi.stubGlobal("WebSocket", Socket);
    Socket.opened = [];
    links.length = 0;
    stream = new ClassStream("/api/class/stream", { onAnswer: () => undefined, onLink: (open) => links.push(open) });
  });
  afterEach(() => {
    stream.close();
    vi.useRealTimers();
    vi.unstubAllGlobals();
  });

  it("that was silent is opened anew when the device comes back, and tells of no loss", () => {
    Socket.opened[0]!.receive('{"is":"pupil"}');
    wake();
    expect(Socket.opened).toHaveLength(1);
    vi.advanceTimersByTime(7000);
    wake();
    expect(Socket.opened.map(({ closed }) => closed)).toEqual([true, false]);
    expect(links).toEqual([true]);
    Socket.opened[1]!.dispatchEvent(new Event("open"));
    vi.advanceTimersByTime(20_000);
    expect(Socket.opened).toHaveLength(2);
  });

  it("that another page has taken over stays closed, as after a goodbye", () => {
    Socket.opened[0]!.receive('{"is":"error","code":"taken-over"}');
    vi.advanceTimersByTime(60_000);
    wake();
    expect(Socket.opened).toHaveLength(1);
  });
});

const CARS = decodeWall(bytesOf(GOLDEN))!.worlds.get(0)!;
const worldWith = (more: object) => ({ pupil: "", mat: {}, leads: [0], radius_m: 0.075, cars: 2, zones: [], goals: [], ...more }) as unknown as WallWorld;

describe("the projector", () => {
  let painted: Painted[];
  beforeEach(() => {
    painted = watchCanvases();
  });
  afterEach(() => {
    vi.restoreAllMocks();
  });

  it("shows the floor of the mat, with its pattern where there is room", () => {
    const world = worldWith({ mat: { format: "motorcade-mat/1", name: "Moon", size_m: [2, 1], floor: "moon" } });
    const fillsOn = (width: number) => {
      painted.length = 0;
      drawWorld(testContext(width, width / 2), { world, cars: undefined, box: boxOf(world, undefined, null) });
      return painted.map(({ colour }) => colour);
    };
    expect(fillsOn(200)).toContain("#aaa8a2");
    expect(fillsOn(200)).not.toContain("#9f9d98");
    expect(fillsOn(1200)).toContain("#9f9d98");
  });

  it("draws each car by the studio's picture, turned to where it drives", () => {
    const own: Painted[] = [];
    const two = { ...CARS, cars: 2, x: [1, 2], y: [1, 2], heading: [0.5, 1], led: [4, 0], flags: [0, 0] } as never;
    const world = worldWith({});
    drawWorld(testContext(300, 200, own), { world, cars: two, box: boxOf(world, two, null) });
    const turned = own.filter(({ what, transform }) => what === "drawImage" && transform[1] !== 0);
    const angles = new Set(turned.map(({ transform }) => Math.atan2(transform[1]!, transform[0]!).toFixed(3)));
    expect([...angles]).toEqual(["-0.500", "-1.000"]);
  });

  it("has names of zones in the page's language", async () => {
    const zones = [{ title: { en: "the garage", zh: "车库" }, name: "garage", centre_m: [1, 1], radius_m: 0.5, corners_m: [] }];
    const world = worldWith({ zones });
    for (const language of ["zh", "en"]) {
      await changeLanguage(language);
      drawWorld(testContext(300, 200), { world, cars: undefined, box: boxOf(world, undefined, null) });
    }
    expect(painted.filter(({ what }) => what === "fillText").map(({ args }) => args[0])).toEqual(["车库", "the garage"]);
  });
});
