import { afterEach, expect, it, vi } from "vitest";
import { LastingStream, post } from "./connection";
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
