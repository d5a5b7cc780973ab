import { expect, it } from "vitest";
import type { CompiledWord } from "../api/types";
import { pictureOf } from "./pictures";
import { runningBlocks, sameRunning } from "./running";

const WORDS: CompiledWord[] = [
  { hex: "01020100", part: "header", values: {}, block: null },
  { hex: "62000000", part: "leader", values: {}, block: "drive" },
  { hex: "a0000000", part: "followers", values: {}, block: "turn" },
  { hex: "a1000000", part: "followers", values: {}, block: "both", fields_of: { motor_speed: "move", led_which: "shine" } },
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
