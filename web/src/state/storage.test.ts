import { afterEach, beforeEach, expect, it, vi } from "vitest";

const own = Object.getOwnPropertyDescriptor(window, "localStorage")!;
const full = () => {
  throw new DOMException("The quota has been exceeded.", "QuotaExceededError");
};

let storage: typeof import("./storage");
beforeEach(async () => {
  vi.resetModules();
  localStorage.clear();
  storage = await import("./storage");
});
afterEach(() => {
  vi.restoreAllMocks();
  Object.defineProperty(window, "localStorage", own);
});

const replaceBy = (described: PropertyDescriptor) => Object.defineProperty(window, "localStorage", { configurable: true, ...described });

it("leaves a store that may be used, also a full one that holds something", () => {
  const before = localStorage;
  storage.replaceForbiddenStorage();
  expect(storage.keep("localStorage", "a", "1")).toBe(true);
  vi.spyOn(Storage.prototype, "setItem").mockImplementation(full);
  storage.replaceForbiddenStorage();
  expect(localStorage).toBe(before);
  expect(localStorage.getItem("a")).toBe("1");
  expect(storage.keep("localStorage", "a", "2")).toBe(false);
});

const FORBIDDEN: [string, () => void][] = [
  ["forbids", () => replaceBy({ get: () => { throw new DOMException("The operation is insecure.", "SecurityError"); } })],
  ["has not", () => replaceBy({ value: null })],
  ["gives no room", () => vi.spyOn(Storage.prototype, "setItem").mockImplementation(full)],
];

it.each(FORBIDDEN)("replaces one that the browser %s", (_, forbid) => {
  forbid();
  storage.replaceForbiddenStorage();
  expect(storage.keep("localStorage", "a", "1")).toBe(false);
  localStorage.setItem("b", "2");
  localStorage.removeItem("b");
  expect([localStorage.getItem("a"), localStorage.getItem("b"), Object.keys(localStorage)]).toEqual(["1", null, ["a"]]);
});
