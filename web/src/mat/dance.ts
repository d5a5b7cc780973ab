/** The dance of a success: each car shows its program once where it stands, a move for each word. */

/** What a car does in a move: drive a little ahead, turn a little (1 to the left, -1 to the right), or hop. */
export type DanceMove = "ahead" | "left" | "right" | "hop";

/** How a car is drawn besides where it is: ahead in half cars, radians to the left, and how much larger. */
export interface DancePose {
  ahead: number;
  turn: number;
  lift: number;
}

const MOVE_MS = 400;
/** The pose at a time of a dance; null once it is over. Each move ends where it began. */
export function poseAt(moves: readonly DanceMove[], tMs: number): DancePose | null {
  const move = moves[Math.floor(tMs / MOVE_MS)];
  if (!move || tMs < 0) return null;
  const far = Math.sin((Math.PI * (tMs % MOVE_MS)) / MOVE_MS);
  return {
    ahead: move === "ahead" ? far : 0,
    turn: move === "left" ? far : move === "right" ? -far : 0,
    lift: move === "hop" ? far * 0.4 : 0,
  };
}
