/** What a new project begins with. */

import type { MatDocument, OpenedProject } from "../api/types";

export const EMPTY_MAT: MatDocument = {
  format: "motorcade-mat/1",
  name: "Table",
  size_m: [4, 3],
  edge: "wall",
  car: [{ at_m: [2.3, 1.5], role: "leader" }],
  crowd: [{ cars: 6, corner_m: [1.2, 0.9], size_m: [0.8, 1.2], spacing_m: 0.4 }],
};

export const BLANK: OpenedProject = { name: "", leader: {}, followers: null, profile: "classroom", mat: EMPTY_MAT, range_mm: null };

const drive = (id: string, direction: string, seconds: number, next?: object) => ({
  type: "motorcade_drive",
  id,
  fields: { DIRECTION: direction, SPEED: "2", SECONDS: seconds },
  ...(next && { next: { block: next } }),
});

/** Forward for three seconds, left for one: what a first look at the blocks shows. */
export const FIRST_STEPS: Pick<OpenedProject, "leader" | "followers"> = {
  leader: {
    blocks: {
      languageVersion: 0,
      blocks: [
        {
          type: "motorcade_leader",
          id: "motorcade_leader",
          x: 24,
          y: 24,
          next: { block: drive("first-forward", "forward", 3, drive("first-left", "left", 1)) },
        },
      ],
    },
  },
  followers: null,
};
