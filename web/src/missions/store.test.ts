import { afterAll, beforeAll, expect, it, vi } from "vitest";
import texts from "virtual:texts/studio";
import { connectTo } from "../api/service";
import type { WorldState } from "../api/world";
import { WorldConnection } from "../api/worldConnection";
import type { Mission } from "../generated/messages";
import { startTexts } from "../i18n";
import { setRange } from "../mat/actions";
import { session } from "../mat/session";
import { choose, chosenCar, editMat, useMat } from "../mat/store";
import { workOf } from "../projects/autosave";
import { comeBack, library, markSaved } from "../projects/project";
import { useDialogs } from "../state/dialogs";
import { useQuestion } from "../state/questions";
import { useStudio } from "../state/studio";
import { playMission, useMission, watchMissions, watchMoment } from "./store";

const BEGINNING = { blocks: { beginning: true } };
const mission = (id: string) =>
  ({ id, name: { en: id, zh: id }, leader: BEGINNING, followers: null, profile: "classroom", mat: { format: "motorcade-mat/1", name: id }, seed: 0, level: "start", goals: [] }) as unknown as Mission;

async function play(id: string): Promise<void> {
  void playMission({ id });
  await vi.advanceTimersByTimeAsync(100);
}

beforeAll(async () => {
  await startTexts(texts);
  vi.useFakeTimers();
  connectTo({ ask: (_: string, choice: unknown) => Promise.resolve(mission((choice as { id: string }).id) as never), openStream: vi.fn() });
  library.watch();
  watchMissions();
  markSaved();
});

afterAll(() => {
  useQuestion.getState().question?.answer("no");
  useDialogs.setState({ notices: [] });
  useStudio.setState({ mission: null, kept: null, attempts: {}, name: "" });
  useMat.setState(useMat.getInitialState());
  vi.useRealTimers();
});

it("from one mission to another nothing is asked, and nothing is lost", async () => {
  await play("first");
  const mine = { blocks: { mine: true } };
  useStudio.setState({ leader: mine });
  await play("second");
  expect(useQuestion.getState().question).toBeNull();
  expect(useStudio.getState()).toMatchObject({ name: "second", leader: BEGINNING, unsaved: false });
  await play("first");
  expect(useStudio.getState()).toMatchObject({ name: "first", leader: mine, unsaved: true });
  // The notice offers the beginning of the mission; that loses the blocks, so it is asked about.
  useDialogs.getState().notices.find(({ action }) => action)?.action?.run();
  await vi.advanceTimersByTimeAsync(100);
  useQuestion.getState().question?.answer("yes");
  await vi.advanceTimersByTimeAsync(100);
  expect(useStudio.getState()).toMatchObject({ name: "first", leader: BEGINNING });
});

it("the own project comes back as it stood when a mission was opened, unsaved changes included", async () => {
  const own = { name: "Mine", leader: { blocks: { project: true } }, rangeMm: 700 };
  useMission.setState({ mission: null });
  useStudio.setState({ mission: null, kept: null, attempts: {}, ...own });
  markSaved();
  const changed = { blocks: { project: true, more: true } };
  useStudio.setState({ leader: changed });
  await play("first");
  expect(useQuestion.getState().question).toBeNull();
  const tried = { blocks: { tried: true } };
  useStudio.setState({ leader: tried });
  await play("second");
  comeBack();
  await vi.advanceTimersByTimeAsync(100);
  expect(useStudio.getState()).toMatchObject({ ...own, leader: changed, unsaved: true, mission: null, kept: null });
  // It knows what was saved, too.
  useStudio.setState({ leader: own.leader });
  expect(useStudio.getState().unsaved).toBe(false);
  await play("first");
  expect(useStudio.getState()).toMatchObject({ name: "first", leader: tried });
});

it("the own project is kept over a reload of the page", async () => {
  comeBack();
  useStudio.setState({ name: "Mine", leader: { blocks: { project: true } } });
  await play("second");
  expect(workOf(useStudio.getState(), 1).kept).toMatchObject({ name: "Mine", leader: { blocks: { project: true } } });
});

it("a mission's mat, cars and range stay as they are, and a sentence says so", async () => {
  await play("first");
  const { mat, rangeMm } = useStudio.getState();
  useDialogs.setState({ notices: [] });
  editMat({ ...mat, size_m: [9, 9] });
  setRange(5000);
  expect(useStudio.getState()).toMatchObject({ mat, rangeMm });
  expect(useDialogs.getState().notices.map(({ text }) => text)).toEqual([expect.stringContaining("The mission fixes")]);
  // Its floor changes no run.
  editMat({ ...mat, floor: "moon" });
  expect(useStudio.getState().mat.floor).toBe("moon");
});

it("what a goal shows is its moment, played from just before, with all cars that were wrong, until another is chosen", async () => {
  useMat.setState({ state: { t_ms: 2600 } as WorldState });
  const send = vi.spyOn(WorldConnection.prototype, "send").mockReturnValue(true);
  session.open();
  send.mockClear();
  watchMoment(2500, [3, 1]);
  await vi.advanceTimersByTimeAsync(5000);
  const sought = send.mock.calls.flatMap(([command]) => (command.do === "seek" ? [command.t_ms!] : []));
  expect(sought).toEqual(Array.from({ length: 22 }, (_, step) => 500 + 100 * step));
  // Whoever does something else ends it.
  watchMoment(2500, [3, 1]);
  session.play();
  send.mockClear();
  await vi.advanceTimersByTimeAsync(5000);
  expect(send.mock.calls.filter(([command]) => command.do === "seek")).toEqual([]);
  session.close();
  send.mockRestore();
  expect(chosenCar()).toBe(3);
  expect(useMat.getState().told).toEqual([3, 1]);
  choose({ car: 0 });
  expect(useMat.getState().told).toEqual([]);
});
