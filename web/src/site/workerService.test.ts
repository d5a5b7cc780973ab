import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import { RefusedError, UnreachableError } from "../api/service";
import { useStudio } from "../state/studio";
import type { FromWorker, ToWorker } from "./protocol";
import { WorkerService } from "./workerService";

class MockWorker {
  static made: MockWorker[] = [];
  readonly received: ToWorker[] = [];
  isTerminated = false;
  onmessage: (event: { data: FromWorker }) => void = vi.fn();
  onerror: (event: { message: string }) => void = vi.fn();
  constructor() {
    MockWorker.made.push(this);
  }
  postMessage(message: ToWorker) {
    this.received.push(message);
  }
  terminate() {
    this.isTerminated = true;
  }
  say(message: FromWorker) {
    this.onmessage({ data: message });
  }
  asked() {
    return this.received.filter((message) => message.is === "ask");
  }
  /** Answer the newest request. */
  answer(answer: unknown) {
    this.say({ is: "answer", id: this.asked().at(-1)!.id, answer: JSON.stringify(answer) });
  }
}

const TEXT = { text: "{}" };
const PLACES = { pyodide: "pyodide/", msgspec: "m.whl", bytecode: "b.zip", python: "p.zip", engine: "e.wasm" };
const makeService = (isFirstVisit = false) =>
  new WorkerService(() => new MockWorker() as unknown as Worker, PLACES, (name) => `https://site.example/studio/${name}?v=1`, isFirstVisit);
const newest = () => MockWorker.made.at(-1)!;
const state = () => useStudio.getState().service;
const nothing = () => ({ onOpen: vi.fn(), onMessage: vi.fn(), onClose: vi.fn() });

beforeEach(() => {
  vi.useFakeTimers();
  vi.spyOn(console, "warn").mockReturnValue(undefined);
  MockWorker.made = [];
});
afterEach(() => {
  vi.useRealTimers();
  vi.restoreAllMocks();
  useStudio.setState({ service: "ready" });
});

describe("a request", () => {
  it("that saves a project asks the browser once to keep what is stored", async () => {
    const persist = vi.fn(() => Promise.resolve(true));
    Object.defineProperty(navigator, "storage", { value: { persist }, configurable: true });
    const service = makeService();
    newest().say({ is: "ready" });
    const project = { leader: {}, followers: null, profile: "classroom" } as never;
    for (const version of [1, 2]) {
      const saved = service.ask("projects/write", { name: "a", project, base: null });
      newest().answer({ answer: { version, stays: true } });
      expect(await saved).toEqual({ version, stays: true });
    }
    expect(persist).toHaveBeenCalledTimes(1);
  });

  it("is answered, or refused with its sentence", async () => {
    const service = makeService();
    expect(state()).toBe("starting");
    newest().say({ is: "ready" });
    expect(state()).toBe("ready");
    const opened = service.ask("open", TEXT);
    newest().answer({ answer: { profile: "classroom" } });
    expect(await opened).toEqual({ profile: "classroom" });
    const refused = service.ask("open", TEXT);
    newest().answer({ error: { code: "no-json", details: {}, sentence: { en: "No.", zh: "不。" } } });
    await expect(refused).rejects.toEqual(new RefusedError("no-json", { en: "No.", zh: "不。" }));
  });

  it("that takes long has a worker of its own", () => {
    const service = makeService();
    void service.ask("missions/check", { mission: { id: "", document: null }, leader: {}, followers: null });
    void service.ask("open", TEXT);
    expect(MockWorker.made.map((worker) => worker.asked().map(({ name }) => name))).toEqual([["open"], ["missions/check"]]);
  });

  it("lets Python start on a first visit, which otherwise leaves the processors to the page for three seconds", async () => {
    vi.spyOn(globalThis, "fetch").mockImplementation(() => Promise.resolve(new Response("[]")));
    const started = () => newest().received.filter((message) => message.is === "start").length;
    const service = makeService(true);
    await service.ask("profiles", null);
    expect(started()).toBe(0);
    void service.ask("open", TEXT);
    await vi.advanceTimersByTimeAsync(0);
    expect(started()).toBe(1);
    makeService(true);
    await vi.advanceTimersByTimeAsync(2900);
    expect(started()).toBe(0);
    await vi.advanceTimersByTimeAsync(200);
    expect(started()).toBe(1);
    makeService();
    await vi.advanceTimersByTimeAsync(0);
    expect(started()).toBe(1);
  });

  it("that never changes is answered by a file, without Python", async () => {
    const files = vi.spyOn(globalThis, "fetch").mockResolvedValue(new Response("[]"));
    const service = makeService();
    expect(await Promise.all([service.ask("profiles", null), service.ask("profiles", null)])).toEqual([[], []]);
    expect(files.mock.calls.map(([url]) => url)).toEqual(["https://site.example/studio/start/profiles.json?v=1"]);
    expect(newest().asked()).toEqual([]);
  });
});

describe("a worker that ends", () => {
  it("is started again and asked again, once", async () => {
    const service = makeService();
    newest().say({ is: "ready" });
    const asked = service.ask("open", TEXT);
    MockWorker.made[0]!.onerror({ message: "out of memory" });
    expect(MockWorker.made[0]!.isTerminated).toBe(true);
    expect(state()).toBe("restarting");
    expect(newest().asked()).toEqual(MockWorker.made[0]!.asked());
    newest().say({ is: "ready" });
    expect(state()).toBe("ready");
    newest().say({ is: "dead", reason: "out of memory" });
    await expect(asked).rejects.toThrow(UnreachableError);
    expect(newest().asked()).toEqual([]);
  });

  it("closes its streams, which the page opens again", () => {
    const service = makeService();
    const listeners = nothing();
    const stream = service.openStream("world", "a", listeners);
    expect(stream.send("{}")).toBe(false);
    newest().say({ is: "ready" });
    newest().say({ is: "opened", stream: 1 });
    expect(stream.send("{}")).toBe(true);
    newest().say({ is: "data", stream: 1, data: "hello" });
    newest().onerror({ message: "killed" });
    expect(listeners.onMessage).toHaveBeenCalledWith("hello");
    expect(listeners.onClose).toHaveBeenCalledOnce();
    expect(stream.send("{}")).toBe(false);
  });

  it("three times before it was ready has failed, and refuses what is asked", async () => {
    const service = makeService();
    const asked = service.ask("open", TEXT);
    const refused = expect(asked).rejects.toThrow(UnreachableError);
    for (let k = 0; k < 3; k++) newest().say({ is: "failed", reason: "no file" });
    expect([state(), MockWorker.made.length]).toEqual(["failed", 3]);
    await refused;
    await expect(service.ask("open", TEXT)).rejects.toThrow(UnreachableError);
  });
});

describe("a worker that hangs", () => {
  it("is started again after 20 seconds without an answer", () => {
    makeService();
    newest().say({ is: "ready" });
    vi.advanceTimersByTime(18_000);
    newest().say({ is: "pong" });
    vi.advanceTimersByTime(20_000);
    expect(MockWorker.made).toHaveLength(1);
    vi.advanceTimersByTime(4000);
    expect(MockWorker.made).toHaveLength(2);
    expect(state()).toBe("restarting");
  });

  it("has time while Python starts", () => {
    makeService();
    vi.advanceTimersByTime(300_000);
    expect(MockWorker.made).toHaveLength(1);
  });
});
