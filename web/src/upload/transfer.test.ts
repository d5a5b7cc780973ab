import { afterEach, describe, expect, it, vi } from "vitest";
import { connectTo } from "../api/service";
import { PlayedStream } from "../api/testStream";
import { CutOffError, PortBusyError, type SerialPort, transfer, transferBySerial } from "./transfer";

connectTo({
  ask: vi.fn(),
  openStream: (_, __, listeners) => new PlayedStream(listeners),
});
afterEach(() => void vi.clearAllMocks());
const newest = () => PlayedStream.all.at(-1)!;

describe("an upload", () => {
  it("asks for its port, tells its progress and its outcome", async () => {
    const progress = vi.fn();
    const done = transfer("/dev/car", { image: "AAAA", verify: true }, progress);
    const stream = newest();
    stream.open();
    expect(stream.messages).toEqual([{ port: "/dev/car", image: "AAAA", verify: true }]);
    stream.say({ sent: 2, of: 4 });
    stream.say({ outcome: "not-verified" });
    expect(await done).toEqual({ outcome: "not-verified" });
    expect(progress).toHaveBeenCalledWith({ sent: 2, of: 4 });
    expect(stream.isOpen).toBe(false);
  });

  it("never calls a broken connection done", async () => {
    const done = transfer("/dev/car", { readback: true }, vi.fn());
    newest().end();
    await expect(done).rejects.toThrow(CutOffError);
  });
});

/** A port of Web Serial, played by the test. */
class PlayedPort extends EventTarget implements SerialPort {
  readonly written: number[][] = [];
  readonly open = vi.fn(() => Promise.resolve());
  readonly close = vi.fn(() => Promise.resolve());
  readable: SerialPort["readable"] = null;
  writable = new WritableStream<Uint8Array>({ write: (bytes) => void this.written.push([...bytes]) });
  private fromCar!: ReadableStreamDefaultController<Uint8Array<ArrayBuffer>>;

  constructor() {
    super();
    this.renew();
  }

  /** The stream of bytes after a fault of the line. */
  renew(): void {
    this.readable = new ReadableStream({ start: (stream) => void (this.fromCar = stream) });
  }

  come(...bytes: number[]): void {
    this.fromCar.enqueue(new Uint8Array(bytes));
  }

  /** A read fails: the line had a fault, or the cable is out. */
  fail(isGone: boolean): void {
    const failed = this.fromCar;
    if (isGone) this.readable = null;
    else this.renew();
    failed.error(new DOMException("The device has been lost.", "NetworkError"));
  }
}

/** A readback through the port, begun: its end, and the service's end of its stream. */
async function begin(port: PlayedPort) {
  const before = newest();
  const done = transferBySerial(port, 115_200, { readback: true }, vi.fn());
  await vi.waitFor(() => expect(newest()).not.toBe(before));
  const stream = newest();
  stream.open();
  return { done, stream };
}

describe("an upload through the browser's own port", () => {
  it("carries bytes both ways and closes the port", async () => {
    const port = new PlayedPort();
    const { done, stream } = await begin(port);
    port.come(79, 75);
    await vi.waitFor(() => expect(stream.sent).toEqual(['{"readback":true}', new Uint8Array([79, 75])]));
    stream.say(new Uint8Array([1, 2]).buffer);
    await vi.waitFor(() => expect(port.written).toEqual([[1, 2]]));
    stream.say({ outcome: "image", image: "AAAA" });
    expect(await done).toEqual({ outcome: "image", image: "AAAA" });
    expect(port.close).toHaveBeenCalledOnce();
    expect(port.open).toHaveBeenCalledWith({ baudRate: 115_200 });
  });

  it("goes on after a fault of the line", async () => {
    const port = new PlayedPort();
    const { done, stream } = await begin(port);
    port.fail(false);
    port.come(79);
    await vi.waitFor(() => expect(stream.sent).toEqual(['{"readback":true}', new Uint8Array([79])]));
    stream.say({ outcome: "image", image: "AAAA" });
    await done;
  });

  const pulls: [string, (port: PlayedPort) => void][] = [
    ["a read fails", (port) => port.fail(true)],
    ["the browser says so", (port) => port.dispatchEvent(new Event("disconnect"))],
  ];
  it.each(pulls)("tells the service once that the cable was pulled: %s", async (_, pull) => {
    const port = new PlayedPort();
    const { done, stream } = await begin(port);
    pull(port);
    await vi.waitFor(() => expect(stream.sent).toEqual(['{"readback":true}', "gone"]));
    port.dispatchEvent(new Event("disconnect"));
    stream.say({ outcome: "failed", error: {} });
    await done;
    expect(stream.sent).toHaveLength(2);
  });

  it("says that a port can't be opened", async () => {
    const port = new PlayedPort();
    port.open.mockRejectedValueOnce(new DOMException("Failed to open serial port.", "NetworkError"));
    await expect(transferBySerial(port, 115_200, { readback: true }, vi.fn())).rejects.toThrow(PortBusyError);
  });
});
