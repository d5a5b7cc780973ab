import type { CompiledWord } from "../api/types";
import { MOST_MOVES, type Move } from "../mat/dance";
import { valueOf } from "../words/bits";

const DIRECTIONS: readonly Move[] = ["ahead", "left", "right", "ahead"];

/** The moves of one part of a program; a program without words of this part hops once. */
export function danceOf(words: readonly CompiledWord[], part: CompiledWord["part"]): readonly Move[] {
  const moves = words.filter((word) => word.part === part).map((word): Move => (valueOf(word, "motor_enable") ? DIRECTIONS[valueOf(word, "motor_direction")]! : "hop"));
  return moves.length ? moves.slice(0, MOST_MOVES) : ["hop"];
}
