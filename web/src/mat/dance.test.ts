import { expect, it } from "vitest";
import type { CompiledWord } from "../api/types";
import { poseAt } from "./dance";
import { danceOf } from "./moves";

const word = (hex: string, part: CompiledWord["part"]) => ({ hex, part }) as CompiledWord;
// Forward, left and an LED, as the compiler makes them.
const FORWARD = "65000000";
const LEFT = "6c800000";
const LED = "40080000";

it("each word of a part is a move, in order, and a part without words hops", () => {
  const words = [word("03000000", "header"), word(FORWARD, "leader"), word(LEFT, "leader"), word(LED, "leader")];
  expect(danceOf(words, "leader")).toEqual(["ahead", "left", "hop"]);
  expect(danceOf(words, "followers")).toEqual(["hop"]);
});

it("a dance is over within five seconds, however long the program is, and every move ends where it began", () => {
  const moves = danceOf(Array.from({ length: 255 }, () => word(LEFT, "leader")), "leader");
  expect(poseAt(moves, 200)!.turn).toBeCloseTo(1);
  for (let tMs = 0; tMs < 4800; tMs += 400) expect(poseAt(moves, tMs)!.turn).toBeCloseTo(0);
  expect(poseAt(moves, 5000)).toBeNull();
});
