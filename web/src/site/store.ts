/** The browser's own store of projects: IndexedDB, or the memory of this worker where there is none. */

import { type IDBPDatabase, openDB } from "idb";
import type { PythonStorage } from "./python";

const NAME = "motorcade";
/** A later version of the page that stores something else counts it up, and changes older stores when they are opened. */
const VERSION = 1;
const VERSIONS = "versions";
const VALUES = "values";
const REVISION = "revision";
/** The name of the virtual car's image among the values. */
const CAR = "virtual-car";

/** [owner, name, version, time in ms, bytes, digest] of a version of a project; the store has its text under it. */
type Key = (string | number)[];

/** Why the store can't be opened, or refuses a change. */
type Problem = "missing" | "newer" | "damaged" | "full";

/** What one transaction changes. It changes nothing where the store has another `revision`; with null it changes the store in any case. */
interface Changes {
  revision: number | null;
  put?: [Key, string][];
  remove?: Key[];
  values?: Record<string, unknown>;
}

/** The store of all tabs; Python's `motorcade.browser.storage` has the rules. */
interface Store {
  /** How many changes were made; it differs where another tab has changed something. */
  revision(): Promise<number>;
  /** Everything but the texts, as JSON. */
  index(): Promise<string>;
  /** Pairs of a key and its text, null where it can't be read. */
  texts(keys: string): Promise<string>;
  /** Make all changes or none; return the new revision, or why none was made: `stale`, another tab was faster. */
  commit(changes: string): Promise<number | "stale" | Problem>;
}

/** Open the browser's store; where that fails, one in memory that says so. */
export async function openStore(): Promise<Store> {
  try {
    const db = await openDB(NAME, VERSION, {
      upgrade(fresh) {
        fresh.createObjectStore(VERSIONS);
        fresh.createObjectStore(VALUES);
      },
      // A newer page waits in another tab until this one lets go.
      blocking: () => db.close(),
    });
    return new BrowserStore(db);
  } catch (error) {
    return new MemoryStore(problemOf(error, "missing"));
  }
}

function problemOf(error: unknown, otherwise: Problem): Problem {
  const name = error instanceof Error || error instanceof DOMException ? error.name : "";
  if (name === "VersionError") return "newer";
  if (name === "QuotaExceededError") return "full";
  // Chromium's and Firefox's names for files that they can't read.
  if (["UnknownError", "DataError", "NotReadableError", "NotFoundError"].includes(name)) return "damaged";
  return otherwise;
}

class BrowserStore implements Store {
  constructor(private readonly db: IDBPDatabase) {}

  async revision(): Promise<number> {
    try {
      return countOf(await this.db.get(VALUES, REVISION));
    } catch {
      // It differs from every revision, so that the index tells why.
      return -2;
    }
  }

  async index(): Promise<string> {
    try {
      const transaction = this.db.transaction([VERSIONS, VALUES]);
      const values = transaction.objectStore(VALUES);
      const [keys, names, found] = await Promise.all([
        transaction.objectStore(VERSIONS).getAllKeys(),
        values.getAllKeys(),
        values.getAll(),
      ]);
      const byName = Object.fromEntries(names.map((name, number) => [typeof name === "string" ? name : "", found[number] as unknown]));
      return JSON.stringify({ revision: countOf(byName[REVISION]), keys, values: byName, most_bytes: await room() });
    } catch (error) {
      return emptyIndex(-2, problemOf(error, "newer"));
    }
  }

  async texts(keys: string): Promise<string> {
    const read = async (key: Key) => [key, await this.db.get(VERSIONS, key).catch(() => null) as unknown];
    return JSON.stringify(await Promise.all((JSON.parse(keys) as Key[]).map(read)));
  }

  async commit(changes: string): Promise<number | "stale" | Problem> {
    const { revision: expected, put = [], remove = [], values = {} } = JSON.parse(changes) as Changes;
    try {
      const transaction = this.db.transaction([VERSIONS, VALUES], "readwrite", { durability: "strict" });
      const [versions, store] = [transaction.objectStore(VERSIONS), transaction.objectStore(VALUES)];
      const revision = countOf(await store.get(REVISION));
      if (expected !== null && revision !== expected) return "stale";
      // The first failure tells why; all others are only told that it ended the transaction.
      let failure: unknown = null;
      const fail = (error: unknown) => void (failure ??= error);
      const done = transaction.done.catch(fail);
      try {
        for (const [key, text] of put) versions.put(text, key).catch(fail);
        for (const key of remove) versions.delete(key).catch(fail);
        for (const [name, value] of Object.entries({ ...values, [REVISION]: revision + 1 })) store.put(value, name).catch(fail);
      } catch (error) {
        fail(error);
        transaction.abort();
      }
      await done;
      return failure ? problemOf(failure, "damaged") : revision + 1;
    } catch (error) {
      return problemOf(error, "newer");
    }
  }
}

/** A store that lasts as long as this worker. */
class MemoryStore implements Store {
  private count = 0;
  private readonly found = new Map<string, string>();
  private readonly values: Record<string, unknown> = {};

  constructor(private readonly problem: Problem) {}

  revision(): Promise<number> {
    return Promise.resolve(this.count);
  }

  index(): Promise<string> {
    const keys = [...this.found.keys()].map((key) => JSON.parse(key) as Key);
    return Promise.resolve(emptyIndex(this.count, this.problem, keys, this.values));
  }

  texts(keys: string): Promise<string> {
    return Promise.resolve(JSON.stringify((JSON.parse(keys) as Key[]).map((key) => [key, this.found.get(JSON.stringify(key))])));
  }

  commit(changes: string): Promise<number> {
    const { put = [], remove = [], values = {} } = JSON.parse(changes) as Changes;
    for (const [key, text] of put) this.found.set(JSON.stringify(key), text);
    for (const key of remove) this.found.delete(JSON.stringify(key));
    Object.assign(this.values, values);
    this.count += 1;
    return Promise.resolve(this.count);
  }
}

function emptyIndex(revision: number, problem: Problem, keys: Key[] = [], values = {}): string {
  return JSON.stringify({ revision, keys, values, problem });
}

function countOf(value: unknown): number {
  return typeof value === "number" ? value : 0;
}

/** How many bytes the browser lets this site store; null where it doesn't say. */
async function room(): Promise<number | null> {
  const storage = (navigator as { storage?: Partial<StorageManager> }).storage;
  return (await storage?.estimate?.().catch(() => null))?.quota ?? null;
}

/** Answer requests that use the store, one after another: each answer is given once its changes are stored. */
export class StoredRequests {
  private last: Promise<unknown> = Promise.resolve();

  constructor(
    private readonly store: Store,
    private readonly storage: PythonStorage,
  ) {}

  /** Run a request, more than once where it needs texts, or another tab was faster; `refuse` answers it where the store can't change. */
  answer<Answer>(run: () => Answer, refuse: (why: Problem) => Answer): Promise<Answer> {
    const answered = this.last.then(() => this.run(run, refuse));
    this.last = answered.catch(() => undefined);
    return answered;
  }

  /** Store what was uploaded to the virtual car, if anything was. */
  async keepCar(): Promise<void> {
    const image = this.storage.take_car_image();
    if (image) await this.store.commit(JSON.stringify({ revision: null, values: { [CAR]: image } } satisfies Changes));
  }

  private async run<Answer>(run: () => Answer, refuse: (why: Problem) => Answer): Promise<Answer> {
    const { store, storage } = this;
    for (;;) {
      if (storage.revision !== (await store.revision())) storage.load(await store.index());
      let answer = run();
      for (let wanted = storage.wanted(); wanted !== "[]"; wanted = storage.wanted()) {
        storage.supply(await store.texts(wanted));
        answer = run();
      }
      const changes = storage.changes();
      const outcome = changes ? await store.commit(changes) : storage.revision;
      if (typeof outcome === "number") {
        storage.settle(outcome);
        return answer;
      }
      storage.load(await store.index());
      if (outcome !== "stale") return refuse(outcome);
    }
  }
}
