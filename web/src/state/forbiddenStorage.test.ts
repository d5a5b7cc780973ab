import { afterEach, expect, it } from "vitest";
import { replaceForbiddenStorage } from "./forbiddenStorage";

const own = Object.getOwnPropertyDescriptor(window, "localStorage")!;
afterEach(() => void Object.defineProperty(window, "localStorage", own));

it("leaves a store that may be used", () => {
  const before = localStorage;
  expect(replaceForbiddenStorage()).toBe(false);
  expect(localStorage).toBe(before);
});

it("replaces one that the browser forbids", () => {
  const get = () => {
    throw new DOMException("The operation is insecure.", "SecurityError");
  };
  Object.defineProperty(window, "localStorage", { configurable: true, get });
  expect(replaceForbiddenStorage()).toBe(true);
  localStorage.setItem("a", "1");
  localStorage.setItem("b", "2");
  localStorage.removeItem("b");
  expect([localStorage.getItem("a"), localStorage.getItem("b"), Object.keys(localStorage)]).toEqual(["1", null, ["a"]]);
});
