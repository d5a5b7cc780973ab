/** A pair in a class: the server has the windows. */

import { askClass } from "../classroom/ask";
import type { Shared } from "./store";

export const CLASSROOM: Shared = {
  read: (window) => askClass("pair/read", { window }),
  write: (window, project, base) => askClass("pair/write", { window, project, base }),
  take: (window, wants) => askClass("pair/take", { window, wants }),
  swap: (wants) => askClass("pair/swap", { wants }),
  join: () => askClass("pair/join"),
  leave: () => askClass("pair/leave"),
  conduct: (playing) => askClass("pair/conduct", playing),
};
