/** What the project asks the world for. */

import type { SetWorld } from "../generated/messages";
import { useStudio } from "../state/studio";
import { useMat } from "./store";

/** A run, as it can be simulated again. */
export type Run = Omit<SetWorld, "do">;

/** The run of the project as it is now, from its beginning. */
export function runNow(): Run {
  const { compiled, mat, profile, car, rangeMm, mission } = useStudio.getState();
  const { seed } = useMat.getState();
  return { image: compiled?.image ?? null, mat, profile, car, seed, range_mm: rangeMm, mission, counters: compiled?.counters };
}
