/** The last frame that a car received, as a text. */

import i18next from "i18next";
import type { HeardFrame } from "../generated/messages";
import { clock } from "../timeline/events";

/** The control word, the sender and the time; of a tagged frame also its tag and check. */
export function heardText({ word, tag, check, car, t_ms }: HeardFrame): string {
  const frame = { word: word.toUpperCase(), car, time: clock(t_ms) };
  return tag ? i18next.t("mat.hearsTagged", { ...frame, tag, check }) : i18next.t("mat.hears", frame);
}
