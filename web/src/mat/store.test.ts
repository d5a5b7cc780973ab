import { beforeEach, expect, it } from "vitest";
import type { Mat } from "./document";
import { editMat, endEdit, loadMat, redoEdit, undoEdit, useMat } from "./store";

const named = (name: string): Mat => ({ format: "motorcade-mat/1", name });
const name = () => useMat.getState().mat.name;

beforeEach(() => {
  endEdit();
  loadMat(named("first"));
});

it("edits are undone one by one, and redone", () => {
  editMat(named("second"));
  editMat(named("third"));
  undoEdit();
  expect(name()).toBe("second");
  undoEdit();
  undoEdit();
  expect(name()).toBe("first");
  redoEdit();
  redoEdit();
  expect(name()).toBe("third");
});

it("a drag's steps are undone together, two drags are not", () => {
  for (const step of ["a", "b", "c"]) editMat(named(step), "move disc 0");
  endEdit();
  for (const step of ["d", "e"]) editMat(named(step), "move disc 0");
  undoEdit();
  expect(name()).toBe("c");
  undoEdit();
  expect(name()).toBe("first");
});

it("a new edit ends what could be redone, and another document all", () => {
  editMat(named("second"));
  undoEdit();
  editMat(named("other"));
  redoEdit();
  expect(name()).toBe("other");
  loadMat(named("opened"));
  undoEdit();
  expect(name()).toBe("opened");
});

it("the past is bounded", () => {
  for (let k = 0; k < 300; k++) editMat(named(String(k)));
  expect(useMat.getState().undo.length).toBe(100);
});
