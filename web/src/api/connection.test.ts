import { afterEach, expect, it, vi } from "vitest";
import { useStudio } from "../state/studio";
import { LastingStream, post } from "./connection";
import { HttpService } from "./http";
import { RefusedError, type StreamListeners, UnreachableError } from "./service";

afterEach(() => {
  vi.useRealTimers();
  vi.unstubAllGlobals();
});

it("a request that is refused says why, in both languages", async () => {
  const sentence = { en: "No room.", zh: "没有空间。" };
  vi.stubGlobal("fetch", () => Promise.resolve(Response.json({ error: { code: "disk-full", sentence } }, { status: 507 })));
  await expect(post("/api/open", {})).rejects.toEqual(new RefusedError("disk-full", sentence));
});

it("a request reaches nobody where the network or the server behind a proxy is gone", async () => {
  vi.stubGlobal("fetch", () => Promise.reject(new TypeError("no network")));
  await expect(post("/api/open", {})).rejects.toBeInstanceOf(UnreachableError);
  vi.stubGlobal("fetch", () => Promise.resolve(new Response("", { status: 502 })));
  await expect(post("/api/open", {})).rejects.toBeInstanceOf(UnreachableError);
});

it("a stream whose server answered again is soon back the next time too", () => {
  vi.useFakeTimers();
  const opened: StreamListeners[] = [];
  const open = (listeners: StreamListeners) => {
    opened.push(listeners);
    return { send: () => true, close: () => undefined };
  };
  new LastingStream(open, { onAnswer: vi.fn() }).reopen();
  for (let k = 0; k < 5; k++) {
    opened.at(-1)!.onClose();
    vi.advanceTimersByTime(4000);
  }
  opened.at(-1)!.onMessage("{}");
  opened.at(-1)!.onClose();
  vi.advanceTimersByTime(1.25 * 500);
  expect(opened).toHaveLength(7);
});

it("a page says when the network lets requests through and no WebSocket, until one opens", async () => {
  vi.resetModules();
  const { LastingStream, openSocket, useSockets } = await import("./connection");
  vi.useFakeTimers();
  const sockets: EventTarget[] = [];
  class Socket extends EventTarget {
    constructor() {
      super();
      sockets.push(this);
    }
    close(): void {
      this.dispatchEvent(new Event("close"));
    }
  }
  vi.stubGlobal("WebSocket", Socket);
  vi.stubGlobal("fetch", () => Promise.resolve(new Response("")));
  new LastingStream((listeners) => openSocket("/api/world", listeners), { onAnswer: vi.fn() }).reopen();
  await vi.advanceTimersByTimeAsync(6000);
  expect(useSockets.getState().blocked).toBe(true);
  // A socket that nobody answers is given up, and another one is tried.
  await vi.advanceTimersByTimeAsync(5000);
  expect(sockets).toHaveLength(2);
  sockets[1]!.dispatchEvent(new Event("open"));
  expect(useSockets.getState().blocked).toBe(false);
});

it("a page whose server is gone asks for it, later each time, until it is back", async () => {
  vi.useFakeTimers();
  const fetched = vi.fn(() => Promise.reject<Response>(new TypeError("no network")));
  vi.stubGlobal("fetch", fetched);
  const service = new HttpService();
  await Promise.all([1, 2].map(() => expect(service.ask("capabilities", null)).rejects.toBeInstanceOf(UnreachableError)));
  await vi.advanceTimersByTimeAsync(1.25 * (500 + 1000 + 2000));
  expect(fetched).toHaveBeenCalledTimes(2 + 3);
  expect(useStudio.getState().service).toBe("gone");
  fetched.mockImplementation(() => Promise.resolve(Response.json({})));
  await vi.advanceTimersByTimeAsync(4000);
  expect(useStudio.getState().service).toBe("ready");
});
