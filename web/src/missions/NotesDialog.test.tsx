import { act, cleanup, render, screen } from "@testing-library/react";
import userEvent from "@testing-library/user-event";
import { afterEach, beforeAll, beforeEach, expect, it, vi } from "vitest";
import texts from "virtual:texts/studio";
import { connectTo } from "../api/service";
import type { MissionEntry, MissionNotes } from "../generated/messages";
import { startTexts } from "../i18n";
import { openNotes, useDialogs } from "../state/dialogs";
import { NotesDialog } from "./NotesDialog";

const PLACE = { path: "swarm", mat: { format: "motorcade-mat/1", name: "" }, zones: [], minutes: 10 };
const MISSIONS: MissionEntry[] = ["first", "second"].map((id, k) => ({ ...PLACE, id, name: { en: `The ${id}` }, order: k + 1, stars: [1], earned: [] }));
/** Only the first mission has all that a teacher can be told. */
const notesOf = (id: string): MissionNotes => {
  const told = id === "first";
  return {
    ...MISSIONS.find((mission) => mission.id === id)!,
    ...{ level: "start", steps: [], hints: [], story: { en: "Drive home." }, learned: { en: "A car waits." }, goals: [{ kind: "in-zone", star: 2, text: { en: "be at home" } }] },
    aim: told ? { en: "Order matters." } : null,
    say: null,
    mistakes: told ? [{ text: { en: "It turns too late." }, hint: { en: "Look at the corner." } }] : [],
    further: null,
  };
};

beforeAll(() => startTexts(texts));
beforeEach(() => {
  vi.stubGlobal("ResizeObserver", class { observe = vi.fn(); unobserve = vi.fn(); disconnect = vi.fn(); });
  useDialogs.setState({ open: "notes", notesOf: null });
  connectTo({
    ask: (name, message) => Promise.resolve(name === "missions" ? MISSIONS : notesOf((message as { id: string }).id)) as never,
    openStream: () => {
      throw new Error("notes open no stream");
    },
  });
});
afterEach(() => {
  cleanup();
  vi.unstubAllGlobals();
});

const parts = () => [...document.querySelectorAll("article h3")].map(({ textContent }) => textContent);

it("a teacher reads what a mission asks and where pupils go wrong, and of another one only what is known", async () => {
  render(<NotesDialog />);
  await screen.findByText("Notes for teachers: The first");
  expect(parts()).toEqual(["Aim", "The task", "Goals", "Usual mistakes", "What the page says at the end"]);
  expect(screen.getByText(/It turns too late/).textContent).toBe("It turns too late. What helps: Look at the corner.");
  act(() => openNotes("second"));
  await screen.findByText("Notes for teachers: The second");
  expect(parts()).toEqual(["The task", "Goals", "What the page says at the end"]);
});

it("the notes are printed in place of the page, which is printed again once they are closed", async () => {
  const printed: (string | undefined)[] = [];
  vi.stubGlobal("print", () => printed.push(document.documentElement.dataset.print));
  const user = userEvent.setup({ delay: null });
  const { unmount } = render(<NotesDialog />);
  await user.click(await screen.findByRole("button", { name: "Print" }));
  unmount();
  window.print();
  expect(printed).toEqual(["sheet", undefined]);
});
