import { bytesOf, PlayedStream } from "./testStream";
import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import { decodePicture, EventColumn, Flag, KINDS, NO_INDEX, type Picture, LOSS_REASONS } from "./world";
import { type LinkState, sessionOfWindow, WorldConnection } from "./worldConnection";

// Two cars and one event.
const GOLDEN =
  "01 03 0000" + // a picture; of the past, the first after a seek
  "07000000 e8030000" + // frame 7, at 1,000 ms
  "02000000 01000000" + // two cars, one event
  "09000000" + // frames lost lately
  "0000803f 00000040" + // x: 1, 2
  "000000bf 00000000" + // y: -0.5, 0
  "00000000 0000c03f" + // heading: 0, 1.5
  "0300 ffff" + // executes word 3; none
  "0e 00" + // wheels: random at speed 2; standing
  "01 04" + // LED 1; none
  "03 0c" + // runs and sends; lost one and heard one
  "0000" + // up to a multiple of four
  "de030000 01000000" + // at 990 ms car 1
  "05 05 0000" + // lost, in a collision
  "000080a2 00000000"; // the word a2800000 of car 0

describe("a picture's bytes", () => {
  it("are read as they lie", () => {
    const bytes = bytesOf(GOLDEN);
    const picture = decodePicture(bytes)!;
    expect(picture).toMatchObject({ frame: 7, tMs: 1000, past: true, fresh: true, cars: 2, lost: 9 });
    expect([...picture.x, ...picture.y, ...picture.heading]).toEqual([1, 2, -0.5, 0, 0, 1.5]);
    expect([...picture.index]).toEqual([3, NO_INDEX]);
    expect([...picture.wheels, ...picture.led]).toEqual([14, 0, 1, 4]);
    expect([...picture.flags]).toEqual([Flag.runs | Flag.sends, Flag.lost | Flag.heard]);
    const kind = picture.events[EventColumn.kind]!;
    expect([KINDS[kind & 255], LOSS_REASONS[(kind >> 8) & 255]]).toEqual(["lost", "collision"]);
    expect([picture.events[0], picture.events[1], picture.events[3], picture.events[4]]).toEqual([990, 1, 0xa2800000, 0]);
    expect(picture.x.buffer).toBe(bytes);
  });

  it("are refused where they are cut off or of another kind", () => {
    expect(decodePicture(bytesOf(GOLDEN).slice(0, -4))).toBeNull();
    expect(decodePicture(bytesOf(GOLDEN.replace("01", "02")))).toBeNull();
    expect(decodePicture(new ArrayBuffer(3))).toBeNull();
  });
});

describe("a connection", () => {
  const links: LinkState[] = [];
  const pictures: Picture[] = [];
  const connect = () =>
    new WorldConnection(
      "ab".repeat(16),
      { onPicture: (picture) => pictures.push(picture), onAnswer: vi.fn(), onLink: (link) => links.push(link) },
      (stream) => new PlayedStream(stream),
    );
  beforeEach(() => {
    vi.useFakeTimers();
    PlayedStream.all = [];
    links.length = pictures.length = 0;
  });
  afterEach(() => vi.useRealTimers());

  it("comes back with the same session, waiting longer each time", () => {
    connect();
    PlayedStream.all[0]!.open();
    PlayedStream.all[0]!.end();
    vi.advanceTimersByTime(1.25 * 500);
    expect(PlayedStream.all).toHaveLength(2);
    PlayedStream.all[1]!.end();
    vi.advanceTimersByTime(0.74 * 1000);
    expect(PlayedStream.all).toHaveLength(2);
    vi.advanceTimersByTime(0.52 * 1000);
    expect(PlayedStream.all).toHaveLength(3);
    expect(links).toEqual(["connecting", "open", "lost", "connecting", "lost", "connecting"]);
    // A server that is back after an hour has all its pages within four seconds.
    for (let tries = 3; tries < 1000; tries++) {
      PlayedStream.all.at(-1)!.end();
      vi.advanceTimersByTime(4000);
      expect(PlayedStream.all).toHaveLength(tries + 1);
    }
  });

  it("leaves its world to the window that took it over until it is asked back", () => {
    const connection = connect();
    PlayedStream.all[0]!.open();
    PlayedStream.all[0]!.say({ is: "error", code: "taken-over", message: { en: "", zh: "" } });
    expect(PlayedStream.all[0]!.isOpen).toBe(false);
    expect(links.at(-1)).toBe("elsewhere");
    vi.advanceTimersByTime(60_000);
    expect(PlayedStream.all).toHaveLength(1);
    connection.comeBack();
    expect(PlayedStream.all).toHaveLength(2);
  });

  it("takes its world back when somebody comes back to its tab", () => {
    connect();
    PlayedStream.all[0]!.open();
    document.dispatchEvent(new Event("visibilitychange"));
    expect(PlayedStream.all).toHaveLength(1);
    PlayedStream.all[0]!.say({ is: "error", code: "taken-over", message: { en: "", zh: "" } });
    document.dispatchEvent(new Event("visibilitychange"));
    document.dispatchEvent(new Event("visibilitychange"));
    expect(PlayedStream.all).toHaveLength(2);
  });

  it("says nothing while it is lost, and hands on pictures", () => {
    const connection = connect();
    expect(connection.send({ do: "pause" })).toBe(false);
    PlayedStream.all[0]!.open();
    expect(connection.send({ do: "pause" })).toBe(true);
    expect(PlayedStream.all[0]!.messages).toEqual([{ do: "pause" }]);
    PlayedStream.all[0]!.say(bytesOf(GOLDEN));
    expect(pictures.map(({ frame }) => frame)).toEqual([7]);
  });

  it("is over when closed", () => {
    const connection = connect();
    connection.close();
    vi.advanceTimersByTime(60_000);
    expect(PlayedStream.all).toHaveLength(1);
  });
});

it("a window keeps its session", () => {
  const session = sessionOfWindow();
  expect(session).toMatch(/^[0-9a-f]{32}$/);
  expect(sessionOfWindow()).toBe(session);
});
