import { beforeEach, expect, it } from "vitest";
import type { Why } from "../generated/messages";
import { forgetEdits, undo } from "../state/history";
import { useStudio } from "../state/studio";
import { carryOut, cureOf } from "./cures";
import { lossOf, type Mat, withLoss } from "./document";
import type { Session } from "./session";
import { useMat } from "./store";
import { pictureOf } from "./testPictures";

const MAT: Mat = {
  format: "motorcade-mat/1",
  name: "Table",
  size_m: [6, 3],
  edge: "wall",
  car: [{ at_m: [1, 1], role: "leader" }, { at_m: [5, 1] }],
};
const ANSWER: Why = { code: "why-too-far", sentence: { en: "", zh: "" }, car: 0, cure: "", value: 0 };
const session = { picture: pictureOf([{ x: 1, y: 1 }, { x: 5, y: 1 }]), starts: null } as unknown as Session;

beforeEach(() => {
  forgetEdits();
  useStudio.setState({ mat: MAT, rangeMm: null });
  useMat.setState({ hello: null });
});

it("lets infrared reach as far as is needed, and undo takes that back", () => {
  carryOut(session, 1, { ...ANSWER, cure: "range_mm", value: 4001 });
  expect(useStudio.getState().rangeMm).toBe(4050);
  undo();
  expect(useStudio.getState().rangeMm).toBeNull();
});

it.each([
  ["move", 0],
  ["range_mm", 9000],
])("%s %i: lets the car start in front of the other one, and undo takes that back", (cure, value) => {
  carryOut(session, 1, { ...ANSWER, cure, value });
  const [x, y] = useStudio.getState().mat.car![1]!.at_m;
  expect(Math.hypot(x - 1, y - 1)).toBeLessThan(0.6);
  undo();
  expect(useStudio.getState().mat).toEqual(MAT);
});

it("adds a leader, and undo takes it away", () => {
  carryOut(session, 1, { ...ANSWER, car: null, cure: "leader" });
  expect(useStudio.getState().mat.car).toHaveLength(3);
  expect(useStudio.getState().mat.car![2]!.role).toBe("leader");
  undo();
  expect(useStudio.getState().mat).toEqual(MAT);
});

it("lets no message get lost, and undo takes that back", () => {
  const noisy = withLoss(MAT, 0.5);
  useStudio.setState({ mat: noisy });
  carryOut(session, 1, { ...ANSWER, cure: "loss" });
  expect(lossOf(useStudio.getState().mat)).toBe(0);
  undo();
  expect(useStudio.getState().mat).toEqual(noisy);
});

it("offers nothing where nothing is wrong", () => {
  expect(cureOf(ANSWER)).toBeNull();
});
