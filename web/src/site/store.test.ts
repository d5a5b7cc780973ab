import "fake-indexeddb/auto";
import { IDBFactory } from "fake-indexeddb";
import { deleteDB, openDB } from "idb";
import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import type { PythonStorage } from "./python";
import { openStore, StoredRequests } from "./store";

const keyOf = (name: string, version: number) => ["", name, version, 5, 1, "digest"];
const put = (revision: number, name: string, version: number, text = "x") =>
  JSON.stringify({ revision, put: [[keyOf(name, version), text]] });
const CAR = JSON.stringify({ revision: null, values: { "virtual-car": "AAAA" } });
const indexOf = async (store: { index: () => Promise<string> }) => JSON.parse(await store.index()) as Record<string, unknown>;

beforeEach(() => void (globalThis.indexedDB = new IDBFactory()));
afterEach(() => void vi.restoreAllMocks());

describe("the browser's store", () => {
  it("keeps keys, texts and values for the next page", async () => {
    const store = await openStore();
    expect(await indexOf(store)).toMatchObject({ revision: 0, keys: [], values: {} });
    expect(await store.commit(put(0, "a", 1, "one"))).toBe(1);
    expect(await store.commit(JSON.stringify({ revision: 1, values: { "stars/": { square: [1] } } }))).toBe(2);
    await store.commit(CAR);
    const next = await openStore();
    const index = await indexOf(next);
    expect(index).toMatchObject({ revision: 3, keys: [keyOf("a", 1)] });
    expect(index.values).toMatchObject({ "stars/": { square: [1] }, "virtual-car": "AAAA" });
    expect(index).not.toHaveProperty("problem");
    const keys = [keyOf("a", 1), keyOf("a", 2)];
    expect(JSON.parse(await next.texts(JSON.stringify(keys)))).toEqual([[keys[0], "one"], [keys[1], null]]);
    expect(await next.commit(JSON.stringify({ revision: 3, remove: [keyOf("a", 1)] }))).toBe(4);
    expect((await indexOf(store)).keys).toEqual([]);
  });

  it("takes no change made from an older revision", async () => {
    const [one, other] = [await openStore(), await openStore()];
    expect(await one.commit(put(0, "a", 1))).toBe(1);
    expect(await other.commit(put(0, "b", 1))).toBe("stale");
    expect((await indexOf(one)).keys).toEqual([keyOf("a", 1)]);
    expect(await other.commit(put(1, "b", 1))).toBe(2);
  });

  it("makes all changes or none where the browser has no room", async () => {
    const store = await openStore();
    await store.commit(put(0, "a", 1));
    const prototype: { put: (value: unknown, key: IDBValidKey) => IDBRequest } = IDBObjectStore.prototype;
    const original = prototype.put;
    vi.spyOn(prototype, "put").mockImplementation(function (this: IDBObjectStore, value, key) {
      if (value === "too large") throw new DOMException("no room", "QuotaExceededError");
      return original.call(this, value, key);
    });
    const changes = { revision: 1, put: [[keyOf("b", 1), "x"], [keyOf("c", 1), "too large"]], remove: [keyOf("a", 1)] };
    expect(await store.commit(JSON.stringify(changes))).toBe("full");
    expect(await indexOf(store)).toMatchObject({ revision: 1, keys: [keyOf("a", 1)] });
    expect(await store.commit(put(1, "b", 1))).toBe(2);
  });

  it("gives way to a newer page, and says so", async () => {
    const store = await openStore();
    await store.commit(put(0, "a", 1));
    const newer = await openDB("motorcade", 7, { upgrade: () => undefined });
    expect(await indexOf(store)).toMatchObject({ problem: "newer", keys: [] });
    expect(await store.commit(put(1, "b", 1))).toBe("newer");
    expect(await indexOf(await openStore())).toMatchObject({ problem: "newer" });
    expect(await newer.getAllKeys("versions")).toEqual([keyOf("a", 1)]);
    newer.close();
    await deleteDB("motorcade");
  });

  it.each([
    ["SecurityError", "missing"],
    ["UnknownError", "damaged"],
  ])("lasts as long as the page where the browser refuses it by %s", async (name, problem) => {
    vi.spyOn(indexedDB, "open").mockImplementation(() => {
      throw new DOMException("no", name);
    });
    const store = await openStore();
    expect(await store.commit(put(0, "a", 1, "one"))).toBe(1);
    await store.commit(CAR);
    expect(await indexOf(store)).toMatchObject({ problem, keys: [keyOf("a", 1)], values: { "virtual-car": "AAAA" } });
    expect(JSON.parse(await store.texts(JSON.stringify([keyOf("a", 1)])))).toEqual([[keyOf("a", 1), "one"]]);
    await store.commit(JSON.stringify({ revision: 2, remove: [keyOf("a", 1)] }));
    expect((await indexOf(store)).keys).toEqual([]);
  });

  it("is missing in a browser without IndexedDB", async () => {
    vi.stubGlobal("indexedDB", undefined);
    expect(await indexOf(await openStore())).toMatchObject({ problem: "missing" });
    vi.unstubAllGlobals();
  });
});

/** Python's end: it counts saved versions of one project in the index that it has. */
class MockPython implements PythonStorage {
  revision = -1;
  loads = 0;
  wantedOnce = "[]";
  supplied: string[] = [];
  private keys: unknown[] = [];
  private changed = "";

  load(index: string) {
    const found = JSON.parse(index) as { revision: number; keys: unknown[] };
    [this.revision, this.keys, this.changed] = [found.revision, found.keys, ""];
    this.loads += 1;
  }
  wanted() {
    const wanted = this.wantedOnce;
    this.wantedOnce = "[]";
    return wanted;
  }
  supply = (texts: string) => void this.supplied.push(texts);
  changes = () => this.changed;
  settle(revision: number) {
    [this.revision, this.changed] = [revision, ""];
  }
  take_car_image = () => "";

  save = () => {
    const version = this.keys.length + 1;
    this.changed = put(this.revision, "a", version);
    this.keys = [...this.keys, keyOf("a", version)];
    return version;
  };
}

const refuse = (why: string) => `refused: ${why}`;

describe("requests that use the store", () => {
  it("of two tabs at the same moment lose nothing", async () => {
    const tabs = [new MockPython(), new MockPython()];
    const requests = await Promise.all(tabs.map(async (python) => new StoredRequests(await openStore(), python)));
    const saves = [0, 1, 0, 1, 0, 1].map((tab) => requests[tab]!.answer<number | string>(tabs[tab]!.save, refuse));
    expect((await Promise.all(saves)).sort()).toEqual([1, 2, 3, 4, 5, 6]);
    expect((await indexOf(await openStore())).keys).toHaveLength(6);
  });

  it("read the index only where another tab has changed it, and run again for texts", async () => {
    const python = new MockPython();
    const store = await openStore();
    const requests = new StoredRequests(store, python);
    await requests.answer<number | string>(python.save, refuse);
    python.wantedOnce = JSON.stringify([keyOf("a", 1)]);
    let runs = 0;
    await requests.answer<number | string>(() => (runs += 1), refuse);
    expect(runs).toBe(2);
    expect(python.supplied).toEqual([JSON.stringify([[keyOf("a", 1), "x"]])]);
    expect(python.loads).toBe(1);
  });

  it("are answered with the reason where the store refuses, and then go on", async () => {
    const python = new MockPython();
    const store = await openStore();
    const requests = new StoredRequests(store, python);
    vi.spyOn(store, "commit").mockResolvedValueOnce("full");
    expect(await requests.answer<number | string>(python.save, refuse)).toBe("refused: full");
    expect(await requests.answer<number | string>(python.save, refuse)).toBe(1);
    const broken = requests.answer<number | string>(() => {
      throw new Error("Python ended");
    }, refuse);
    await expect(broken).rejects.toThrow("Python ended");
    expect(await requests.answer<number | string>(python.save, refuse)).toBe(2);
  });
});
