import { beforeEach, expect, it, vi } from "vitest";
import { connectTo } from "../api/service";
import type { RemedyChanges, Why } from "../generated/messages";
import { useDialogs } from "../state/dialogs";
import { forgetEdits, undo } from "../state/history";
import { useStudio } from "../state/studio";
import { carryOut, changesBlocks, remedyOf } from "./remedies";
import type { Mat } from "./document";
import { chosenCar, choose } from "./store";

const ask = vi.fn();
connectTo({ ask, openStream: vi.fn() });

const MAT: Mat = {
  format: "motorcade-mat/1",
  name: "Table",
  wall: [{ from_m: [2, 0], to_m: [2, 2] }],
  car: [{ at_m: [1, 1], role: "leader" }, { at_m: [3, 1] }, { at_m: [5, 1] }],
};
const ANSWER: Why = { code: "why-too-far", sentence: { en: "", zh: "" }, car: 0, remedy: "", value: 0 };
const NOTHING: RemedyChanges = { mat: null, range_mm: null, fields: [] };
const answerWith = (answer: Partial<RemedyChanges>) => ask.mockResolvedValue({ ...NOTHING, ...answer });

beforeEach(() => {
  forgetEdits();
  useStudio.setState({ mat: MAT, rangeMm: null });
  useDialogs.setState({ notices: [] });
});

it("lets infrared reach as far as the service says, and undo takes that back", async () => {
  answerWith({ range_mm: 4050 });
  await carryOut(1, { ...ANSWER, remedy: "range_mm", value: 4001 });
  expect(ask.mock.lastCall![1]).toMatchObject({ remedy: "range_mm", value: 4001, car: 1, mat: MAT, range_mm: null });
  expect(useStudio.getState().rangeMm).toBe(4050);
  undo();
  expect(useStudio.getState().rangeMm).toBeNull();
});

it("takes the service's mat, and undo takes that back", async () => {
  const changed = { ...MAT, wall: [] };
  answerWith({ mat: changed });
  await carryOut(1, { ...ANSWER, remedy: "remove-wall" });
  expect(useStudio.getState().mat).toEqual(changed);
  undo();
  expect(useStudio.getState().mat).toEqual(MAT);
});

it("keeps a car chosen whose number changes when another one is taken away", async () => {
  choose({ car: 2 });
  answerWith({ mat: { ...MAT, car: [MAT.car![0]!, MAT.car![2]!] } });
  await carryOut(2, { ...ANSWER, remedy: "remove-car", value: 1 });
  expect(chosenCar()).toBe(1);
});

it("leaves a mat that was changed meanwhile as it is", async () => {
  const moved = { ...MAT, name: "Other" };
  ask.mockImplementation(() => {
    useStudio.setState({ mat: moved });
    return Promise.resolve({ ...NOTHING, mat: MAT });
  });
  await carryOut(1, { ...ANSWER, remedy: "move" });
  expect(useStudio.getState().mat).toBe(moved);
});

it("says that there is no room where nothing changes", async () => {
  answerWith({});
  await carryOut(1, { ...ANSWER, remedy: "move" });
  expect(useDialogs.getState().notices).toHaveLength(1);
});

it("offers a button for what it can do, and in a mission only for blocks", () => {
  expect(remedyOf(ANSWER)).toBeNull();
  expect(remedyOf({ ...ANSWER, remedy: "followers" })).toBeNull();
  expect(remedyOf({ ...ANSWER, remedy: "listen" })).toBe("listen");
  expect([changesBlocks("forward"), changesBlocks("listen"), changesBlocks("move")]).toEqual([true, true, false]);
});
