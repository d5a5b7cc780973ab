import { cleanup, render, screen } from "@testing-library/react";
import userEvent from "@testing-library/user-event";
import { afterEach, beforeAll, expect, it, vi } from "vitest";
import texts from "virtual:texts/page";
import type { PupilView } from "../generated/classroom";
import { startTexts } from "../i18n";
import { PupilBar } from "./PupilBar";
import { usePupil } from "./store";

const ALONE: PupilView = {
  is: "pupil",
  me: { id: "01", name: "Mia", avatar: "bus", number: "1234" },
  hand: false,
  frozen: false,
  stopped: false,
  cabled: false,
  shared: [],
  news: [],
  mission: null,
  pair: null,
  mat: { state: "closed", mission: null, title: { en: "", zh: "" }, places: 0, entries: [] },
};

beforeAll(() => startTexts(texts));
afterEach(() => {
  cleanup();
  vi.unstubAllGlobals();
});

it("tells a pupil who is alone that there is nobody to give a copy to", async () => {
  vi.stubGlobal("fetch", () => Promise.resolve(Response.json([])));
  const user = userEvent.setup({ delay: null });
  usePupil.setState({ view: ALONE });
  render(<PupilBar />);
  await user.click(screen.getByRole("button", { name: "Give a copy" }));
  expect(await screen.findByText("Nobody else is in the class yet.")).toBeTruthy();
});
