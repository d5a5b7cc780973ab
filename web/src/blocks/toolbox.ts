/** What can be dragged from each editor's side. */

import i18next from "i18next";
import type { EditorName } from "../api/types";
import { CATEGORIES, STEP_KINDS } from "../generated/steps";

const drawer = (category: (typeof CATEGORIES)[number]) =>
  STEP_KINDS.filter((each) => each.category === category).map(({ kind }) => `motorcade_${kind}`);

const DRAWERS = {
  ...(Object.fromEntries(CATEGORIES.map((category) => [category, drawer(category)])) as Record<(typeof CATEGORIES)[number], string[]>),
  infrared: ["motorcade_infrared"],
};

/** A leader sends infrared and accepts none, so it has no block for it. */
const DRAWERS_OF: Record<EditorName, readonly (keyof typeof DRAWERS)[]> = {
  leader: CATEGORIES,
  followers: [...CATEGORIES, "infrared"],
};

const HATS: Record<EditorName, string> = { leader: "motorcade_leader", followers: "motorcade_followers" };

export function hatOf(editor: EditorName): string {
  return HATS[editor];
}

/** Whether blocks of this type can stand in the editor at all. */
export function canStandIn(editor: EditorName, type: string): boolean {
  return DRAWERS_OF[editor].some((drawer) => DRAWERS[drawer].includes(type));
}

export function toolboxOf(editor: EditorName) {
  return {
    kind: "categoryToolbox",
    contents: DRAWERS_OF[editor].map((drawer) => ({
      kind: "category",
      name: i18next.t(`drawers.${drawer}`),
      categorystyle: `${drawer}_category`,
      cssconfig: { icon: `drawer-icon drawer-${drawer}` },
      contents: DRAWERS[drawer].map((type) => ({ kind: "block", type })),
    })),
  };
}
