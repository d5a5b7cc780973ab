import { act, cleanup, render, screen } from "@testing-library/react";
import { lazy } from "react";
import texts from "virtual:texts/class";
import { afterEach, beforeAll, expect, it, vi } from "vitest";
import { say, startTexts } from "../i18n";
import { Later, print, usePrinting } from "./panes";

beforeAll(() => startTexts(texts));
afterEach(() => {
  cleanup();
  vi.restoreAllMocks();
});

it("a part that can't be fetched says so in its place, and the rest of the page stays", async () => {
  // React tells of an error that a boundary contains.
  vi.spyOn(console, "error").mockReturnValue();
  const Missing = lazy(() => Promise.reject(new TypeError("Failed to fetch dynamically imported module")));
  render(
    <>
      <h1>Class</h1>
      <Later waiting="soon">
        <Missing />
      </Later>
    </>,
  );
  expect(screen.getByText("soon")).toBeTruthy();
  expect((await screen.findByRole("alert")).textContent).toContain(say("app.failed"));
  expect(screen.getByRole("button", { name: say("app.reload") })).toBeTruthy();
  expect(screen.getByRole("heading", { name: "Class" })).toBeTruthy();
});

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
