import type { Stream, StreamListeners } from "./service";
import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import {
  decodePicture,
  EventColumn,
  Flag,
  KINDS,
  type Link,
  NO_INDEX,
  type Picture,
  sessionOfWindow,
  LOSS_REASONS,
  WorldConnection,
} from "./world";

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

function bytesOf(hex: string): ArrayBuffer {
  const digits = hex.replaceAll(" ", "");
  const bytes = new Uint8Array(digits.length / 2);
  bytes.forEach((_, place) => (bytes[place] = parseInt(digits.slice(2 * place, 2 * place + 2), 16)));
  return bytes.buffer;
}

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

class MockStream implements Stream {
  static made: MockStream[] = [];
  isOpen = false;
  sent: unknown[] = [];
  constructor(readonly listeners: StreamListeners) {
    MockStream.made.push(this);
  }
  open() {
    this.isOpen = true;
    this.listeners.onOpen();
  }
  send(data: unknown): boolean {
    if (this.isOpen) this.sent.push(data);
    return this.isOpen;
  }
  close() {
    this.isOpen = false;
  }
  /** The other end ends it. */
  end() {
    this.isOpen = false;
    this.listeners.onClose();
  }
}

describe("a connection", () => {
  const links: Link[] = [];
  const pictures: Picture[] = [];
  const connect = () =>
    new WorldConnection(
      "ab".repeat(16),
      { onPicture: (picture) => pictures.push(picture), onAnswer: vi.fn(), onLink: (link) => links.push(link) },
      (stream) => new MockStream(stream),
    );
  beforeEach(() => {
    vi.useFakeTimers();
    MockStream.made = [];
    links.length = pictures.length = 0;
  });
  afterEach(() => vi.useRealTimers());

  it("comes back with the same session, waiting longer each time", () => {
    connect();
    MockStream.made[0]!.open();
    MockStream.made[0]!.end();
    vi.advanceTimersByTime(1.25 * 500);
    expect(MockStream.made).toHaveLength(2);
    MockStream.made[1]!.end();
    vi.advanceTimersByTime(0.74 * 1000);
    expect(MockStream.made).toHaveLength(2);
    vi.advanceTimersByTime(0.52 * 1000);
    expect(MockStream.made).toHaveLength(3);
    expect(links).toEqual(["connecting", "open", "lost", "connecting", "lost", "connecting"]);
  });

  it("leaves its world to the window that took it over until it is asked back", () => {
    const connection = connect();
    MockStream.made[0]!.open();
    MockStream.made[0]!.listeners.onMessage('{"is": "error", "code": "taken-over", "message": {"en": "", "zh": ""}}');
    expect(MockStream.made[0]!.isOpen).toBe(false);
    expect(links.at(-1)).toBe("elsewhere");
    vi.advanceTimersByTime(60_000);
    expect(MockStream.made).toHaveLength(1);
    connection.comeBack();
    expect(MockStream.made).toHaveLength(2);
  });

  it("takes its world back when somebody comes back to its tab", () => {
    connect();
    MockStream.made[0]!.open();
    document.dispatchEvent(new Event("visibilitychange"));
    expect(MockStream.made).toHaveLength(1);
    MockStream.made[0]!.listeners.onMessage('{"is": "error", "code": "taken-over", "message": {"en": "", "zh": ""}}');
    document.dispatchEvent(new Event("visibilitychange"));
    document.dispatchEvent(new Event("visibilitychange"));
    expect(MockStream.made).toHaveLength(2);
  });

  it("says nothing while it is lost, and hands on pictures", () => {
    const connection = connect();
    expect(connection.send({ do: "pause" })).toBe(false);
    MockStream.made[0]!.open();
    expect(connection.send({ do: "pause" })).toBe(true);
    expect(MockStream.made[0]!.sent).toEqual(['{"do":"pause"}']);
    MockStream.made[0]!.listeners.onMessage(bytesOf(GOLDEN));
    expect(pictures.map(({ frame }) => frame)).toEqual([7]);
  });

  it("is over when closed", () => {
    const connection = connect();
    connection.close();
    vi.advanceTimersByTime(60_000);
    expect(MockStream.made).toHaveLength(1);
  });
});

it("a window keeps its session", () => {
  const session = sessionOfWindow();
  expect(session).toMatch(/^[0-9a-f]{32}$/);
  expect(sessionOfWindow()).toBe(session);
});
