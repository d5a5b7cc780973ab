import { act, cleanup, render, screen } from "@testing-library/react";
import { afterEach, beforeAll, beforeEach, expect, it } from "vitest";
import texts from "virtual:texts/remote";
import type { CarTelemetry } from "../generated/remote";
import { say, startTexts } from "../i18n";
import { Notices } from "./Cars";
import { useRemote } from "./link";
import { Remote } from "./Remote";

beforeAll(() => startTexts(texts));
beforeEach(() => useRemote.setState(useRemote.getInitialState(), true));
afterEach(cleanup);

it("nothing is red before the first connection has failed", () => {
  render(<Remote />);
  expect(document.querySelector("[data-tone]")).toBeNull();
  cleanup();
  useRemote.setState({ opening: false });
  render(<Remote />);
  expect(screen.getByText(say("remote.lostAbout")).dataset.tone).toBe("error");
});

it("that a car stopped by itself concerns only who has driven", () => {
  const stopped = { state: "failsafe", driver: null, you: { drives: false, waits: false } } as unknown as CarTelemetry;
  useRemote.setState({ opening: false, open: true, telemetry: { red: stopped }, joined: ["red"] });
  const { rerender } = render(<Notices car="red" />);
  expect(screen.getByRole("status").dataset.state).toBe("standing");
  useRemote.setState({ hasDriven: true });
  rerender(<Notices car="red" />);
  expect(screen.getByRole("status").textContent).toBe(say("remote.failsafe"));
});

it("who has left all cars is told to choose one, on the page of a single car too", () => {
  const ada = { car: "ada", name: "ada", leads: null, sees: false };
  useRemote.setState({ opening: false, open: true, cars: [ada], joined: [] });
  render(<Remote />);
  expect(screen.getByText(say("remote.noneChosen"))).toBeTruthy();
  expect(screen.getByRole("option", { name: "ada" })).toBeTruthy();
  act(() => useRemote.setState({ cars: [] }));
  expect(screen.getByText(say("remote.noCars"))).toBeTruthy();
});
