import { afterAll, beforeAll, expect, it, vi } from "vitest";
import { connectTo } from "../api/service";
import type { Mission } from "../generated/messages";
import { startLanguages } from "../i18n";
import { markSaved, watchUnsaved } from "../projects/project";
import { useDialogs } from "../state/dialogs";
import { useStudio } from "../state/studio";
import { playMission, useMission } from "./store";

const BEGINNING = { blocks: { beginning: true } };
const mission = (id: string) =>
  ({ id, name: { en: id, zh: id }, leader: BEGINNING, followers: null, profile: "classroom", mat: { format: "motorcade-mat/1", name: id }, level: "start", goals: [] }) as unknown as Mission;

async function play(id: string): Promise<void> {
  void playMission({ id });
  await vi.advanceTimersByTimeAsync(100);
}

beforeAll(() => {
  vi.useFakeTimers();
  startLanguages();
  connectTo({ ask: (_: string, choice: unknown) => Promise.resolve(mission((choice as { id: string }).id) as never), openStream: vi.fn() });
  watchUnsaved();
  markSaved();
});

afterAll(() => {
  useDialogs.getState().question?.answer(false);
  useDialogs.setState({ notices: [] });
  vi.useRealTimers();
});

it("from one mission to another nothing is asked, and nothing is lost", async () => {
  await play("first");
  const mine = { blocks: { mine: true } };
  useStudio.setState({ leader: mine });
  await play("second");
  expect(useDialogs.getState().question).toBeNull();
  expect(useStudio.getState()).toMatchObject({ name: "second", leader: BEGINNING, unsaved: false });
  await play("first");
  expect(useStudio.getState()).toMatchObject({ name: "first", leader: mine, unsaved: true });
  // The notice offers the beginning of the mission; that loses the blocks, so it is asked about.
  useDialogs.getState().notices.find(({ action }) => action)?.action?.run();
  await vi.advanceTimersByTimeAsync(100);
  useDialogs.getState().question?.answer(true);
  await vi.advanceTimersByTimeAsync(100);
  expect(useStudio.getState()).toMatchObject({ name: "first", leader: BEGINNING });
});

it("a project is asked about before a mission replaces it", async () => {
  useMission.setState({ mission: null });
  useStudio.setState({ mission: null, leader: { blocks: { project: true } } });
  await play("second");
  expect(useDialogs.getState().question).not.toBeNull();
});
