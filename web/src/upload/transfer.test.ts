import { afterEach, describe, expect, it, vi } from "vitest";
import { connectTo, type Stream, type StreamListeners } from "../api/service";
import { CutOffError, transfer, transferBySerial } from "./transfer";

/** The service's end of a stream, played by the test. */
class PlayedStream implements Stream {
  static last: PlayedStream;
  readonly sent: unknown[] = [];
  closed = false;

  constructor(
    readonly name: string,
    readonly listeners: StreamListeners,
  ) {
    PlayedStream.last = this;
  }

  send(data: unknown): boolean {
    this.sent.push(data);
    return true;
  }

  close(): void {
    this.closed = true;
  }

  say(data: unknown): void {
    this.listeners.onMessage(data instanceof ArrayBuffer ? data : JSON.stringify(data));
  }
}

connectTo({
  ask: vi.fn(),
  openStream: (name, _, listeners) => new PlayedStream(name, listeners),
});
afterEach(() => void vi.clearAllMocks());

describe("an upload", () => {
  it("asks for its port, tells its progress and its outcome", async () => {
    const progress = vi.fn();
    const done = transfer("/dev/car", { image: "AAAA", verify: true }, progress);
    const stream = PlayedStream.last;
    stream.listeners.onOpen();
    expect(stream.sent.map((text) => JSON.parse(text as string) as unknown)).toEqual([
      { port: "/dev/car", image: "AAAA", verify: true },
    ]);
    stream.say({ sent: 2, of: 4 });
    stream.say({ outcome: "not-verified" });
    expect(await done).toEqual({ outcome: "not-verified" });
    expect(progress).toHaveBeenCalledWith({ sent: 2, of: 4 });
    expect(stream.closed).toBe(true);
  });

  it("never calls a broken connection done", async () => {
    const done = transfer("/dev/car", { readback: true }, vi.fn());
    PlayedStream.last.listeners.onClose();
    await expect(done).rejects.toThrow(CutOffError);
  });
});

describe("an upload through the browser's own port", () => {
  it("carries bytes both ways and closes the port", async () => {
    const written: number[][] = [];
    const close = vi.fn(() => Promise.resolve());
    let fromCar: ReadableStreamDefaultController<Uint8Array<ArrayBuffer>>;
    const port = {
      open: vi.fn(() => Promise.resolve()),
      close,
      readable: new ReadableStream<Uint8Array<ArrayBuffer>>({ start: (stream) => void (fromCar = stream) }),
      writable: new WritableStream<Uint8Array>({ write: (bytes) => void written.push([...bytes]) }),
    };
    const done = transferBySerial(port, 115_200, { readback: true }, vi.fn());
    await vi.waitFor(() => expect(PlayedStream.last.name).toBe("serial"));
    const stream = PlayedStream.last;
    stream.listeners.onOpen();
    fromCar!.enqueue(new Uint8Array([79, 75]));
    await vi.waitFor(() => expect(stream.sent).toEqual(['{"readback":true}', new Uint8Array([79, 75])]));
    stream.say(new Uint8Array([1, 2]).buffer);
    await vi.waitFor(() => expect(written).toEqual([[1, 2]]));
    stream.say({ outcome: "image", image: "AAAA" });
    expect(await done).toEqual({ outcome: "image", image: "AAAA" });
    expect(close).toHaveBeenCalledOnce();
    expect(port.open).toHaveBeenCalledWith({ baudRate: 115_200 });
  });
});
