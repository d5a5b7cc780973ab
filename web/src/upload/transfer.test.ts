import { afterEach, describe, expect, it, vi } from "vitest";
import { CutOffError, transfer, transferBySerial } from "./transfer";

/** A server's end of a socket, played by the test. */
class PlayedSocket extends EventTarget {
  static readonly OPEN = 1;
  static last: PlayedSocket;
  readonly readyState = 1;
  readonly sent: unknown[] = [];
  closed = false;

  constructor(readonly url: string) {
    super();
    PlayedSocket.last = this;
  }

  send(data: unknown): void {
    this.sent.push(data);
  }

  close(): void {
    this.closed = true;
  }

  say(data: unknown): void {
    this.dispatchEvent(new MessageEvent("message", { data: data instanceof ArrayBuffer ? data : JSON.stringify(data) }));
  }
}

vi.stubGlobal("WebSocket", PlayedSocket);
afterEach(() => void vi.clearAllMocks());

describe("an upload", () => {
  it("asks for its port, tells its progress and its outcome", async () => {
    const progress = vi.fn();
    const done = transfer("/dev/car", { image: "AAAA", verify: true }, progress);
    const socket = PlayedSocket.last;
    socket.dispatchEvent(new Event("open"));
    expect(socket.sent.map((text) => JSON.parse(text as string) as unknown)).toEqual([
      { port: "/dev/car", image: "AAAA", verify: true },
    ]);
    socket.say({ sent: 2, of: 4 });
    socket.say({ outcome: "not-verified" });
    expect(await done).toEqual({ outcome: "not-verified" });
    expect(progress).toHaveBeenCalledWith({ sent: 2, of: 4 });
    expect(socket.closed).toBe(true);
  });

  it("never calls a broken connection done", async () => {
    const done = transfer("/dev/car", { readback: true }, vi.fn());
    PlayedSocket.last.dispatchEvent(new Event("close"));
    await expect(done).rejects.toThrow(CutOffError);
  });
});

describe("an upload through the browser's own port", () => {
  it("carries bytes both ways and closes the port", async () => {
    const written: number[][] = [];
    const close = vi.fn(() => Promise.resolve());
    const port = {
      open: vi.fn(() => Promise.resolve()),
      close,
      readable: new ReadableStream<Uint8Array<ArrayBuffer>>({ start: (stream) => stream.enqueue(new Uint8Array([79, 75])) }),
      writable: new WritableStream<Uint8Array>({ write: (bytes) => void written.push([...bytes]) }),
    };
    const done = transferBySerial(port, 115_200, { readback: true }, vi.fn());
    await vi.waitFor(() => expect(PlayedSocket.last.url).toContain("/api/serial"));
    const socket = PlayedSocket.last;
    await vi.waitFor(() => expect(socket.sent).toEqual([new Uint8Array([79, 75])]));
    socket.say(new Uint8Array([1, 2]).buffer);
    await vi.waitFor(() => expect(written).toEqual([[1, 2]]));
    socket.say({ outcome: "image", image: "AAAA" });
    expect(await done).toEqual({ outcome: "image", image: "AAAA" });
    expect(close).toHaveBeenCalledOnce();
    expect(port.open).toHaveBeenCalledWith({ baudRate: 115_200 });
  });
});
