/** Which dance a program has. */

import type { CompiledWord } from "../api/types";
import { valueOf } from "../words/values";
import type { DanceMove } from "./dance";

/** What moves by itself stops within five seconds (WCAG 2.2.2). */
const MOST_MOVES = 12;

const DIRECTIONS: readonly DanceMove[] = ["ahead", "left", "right", "ahead"];

/** The moves of one part of a program; a program without words of this part hops once. */
export function danceOf(words: readonly CompiledWord[], part: CompiledWord["part"]): readonly DanceMove[] {
  const moves = words
    .filter((word) => word.part === part)
    .map((word): DanceMove => (valueOf(word, "motor_enable") ? DIRECTIONS[valueOf(word, "motor_direction")]! : "hop"));
  return moves.length ? moves.slice(0, MOST_MOVES) : ["hop"];
}
