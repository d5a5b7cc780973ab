import { act, cleanup, render } from "@testing-library/react";
import { afterEach, expect, it, vi } from "vitest";
import { print, usePrinting } from "./panes";

afterEach(cleanup);

it("what is printed is there before the browser is asked, which pauses the page", () => {
  const Paper = () => (usePrinting() ? "paper" : "screen");
  const { container } = render(<Paper />);
  const printed: (string | null)[] = [];
  vi.stubGlobal("print", () => printed.push(container.textContent));
  act(print);
  expect(printed).toEqual(["paper"]);
  act(() => void window.dispatchEvent(new Event("afterprint")));
  expect(container.textContent).toBe("screen");
  vi.unstubAllGlobals();
});
