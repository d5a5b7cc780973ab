import { afterEach, beforeEach, expect, it, vi } from "vitest";
import texts from "virtual:texts/studio";
import { connectTo, RefusedError } from "../api/service";
import { startTexts } from "../i18n";
import { type Choice, useQuestion } from "../state/questions";
import { useStudio } from "../state/studio";
import { BLANK, markSaved, replaceBy, watchUnsaved } from "./project";

const MINE = { blocks: { mine: true } };
const ask = vi.fn<(name: string, message: unknown) => Promise<unknown>>();

await startTexts(texts);
connectTo({ ask: ask as never, openStream: vi.fn() });
watchUnsaved();

beforeEach(() => {
  useStudio.setState({ name: "", leader: {}, kept: null });
  markSaved();
  useStudio.setState({ leader: MINE });
  ask.mockImplementation((name) => Promise.resolve(name === "projects/list" ? [{ name: "Untitled project" }] : { version: 1, stays: true }));
});
afterEach(() => ask.mockReset());

async function open(chosen: Choice): Promise<boolean> {
  const opened = replaceBy({ ...BLANK, name: "Other" });
  useQuestion.getState().question!.answer(chosen);
  return opened;
}

const saved = () => ask.mock.calls.filter(([name]) => name === "projects/write").map(([, message]) => message);

it("the first answer saves the project, under a free name, before another is opened", async () => {
  expect(await open("yes")).toBe(true);
  expect(saved()).toEqual([expect.objectContaining({ name: "Untitled project 2", project: expect.objectContaining({ leader: MINE }) as unknown })]);
  expect(useStudio.getState().name).toBe("Other");
});

it("the project stays where it can't be saved", async () => {
  ask.mockRejectedValue(new RefusedError("disk-full", { en: "No room.", zh: "" }));
  await expect(open("yes")).rejects.toThrow();
  expect(useStudio.getState().leader).toBe(MINE);
});

it.each([
  ["other", "Other"],
  ["no", ""],
] as const)("'%s' saves nothing", async (chosen, name) => {
  await open(chosen);
  expect(saved()).toEqual([]);
  expect(useStudio.getState().name).toBe(name);
});
