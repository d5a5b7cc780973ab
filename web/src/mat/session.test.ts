import { beforeEach, expect, it } from "vitest";
import type { CompiledWord } from "../api/types";
import { useStudio } from "../state/studio";
import type { Mat } from "./document";
import { runningBlocks, sameRunning } from "./session";
import { endEdit, forgetEdits, redo as redoEdit, undo as undoEdit, useHistory } from "../state/history";
import { editMat } from "./store";
import { pictureOf } from "./testPictures";

const WORDS: CompiledWord[] = [
  { hex: "01020100", part: "header", block: null },
  { hex: "62000000", part: "leader", block: "drive" },
  { hex: "a0000000", part: "followers", block: "turn" },
  { hex: "a1000000", part: "followers", block: "both", fields_of: { motor_speed: "move", led_which: "shine" } },
];

it("several blocks run at once, in both editors", () => {
  const running = runningBlocks(pictureOf([{ index: 1 }, { index: 2 }, { index: 3 }, { index: 2 }]), WORDS);
  expect(running.get("leader")).toEqual(["drive"]);
  expect(running.get("followers")).toEqual(["both", "move", "shine", "turn"]);
});

it("a word that is over, none, and one that the page no longer has run nothing", () => {
  const running = runningBlocks(pictureOf([{ index: 1, flags: 0 }, {}, { index: 9 }]), WORDS);
  expect([...running.values()].flat()).toEqual([]);
});

it("the same blocks are the same, whichever cars run them", () => {
  const one = runningBlocks(pictureOf([{ index: 1 }, { index: 2 }]), WORDS);
  const other = runningBlocks(pictureOf([{ index: 2 }, { index: 1 }]), WORDS);
  expect(sameRunning(one, other)).toBe(true);
  expect(sameRunning(one, runningBlocks(pictureOf([{ index: 1 }]), WORDS))).toBe(false);
});

const named = (name: string): Mat => ({ format: "motorcade-mat/1", name });
const name = () => useStudio.getState().mat.name;

beforeEach(() => {
  useStudio.setState({ mat: named("first") });
  forgetEdits();
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
  useStudio.setState({ mat: named("opened") });
  forgetEdits();
  undoEdit();
  expect(name()).toBe("opened");
});

it("the past is bounded", () => {
  for (let k = 0; k < 600; k++) editMat(named(String(k)));
  expect(useHistory.getState().done.length).toBe(500);
});
