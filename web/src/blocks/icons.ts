/** The icon that stands before a block's text, drawn in the colour of the text. */

import * as Blockly from "blockly/core";
import { STEP_KINDS } from "../generated/steps";

const OWN = {
  leader: "m12 3 2.6 5.6 6.1.7-4.5 4.200 1.200 6L12 16.500 6.600 19.500l1.200-6L3.300 9.300l6.100-.7z",
  followers: "M7 4l4 7H3zM17 4l4 7h-8zM12 13l4 7H8z",
  infrared: "M12 18v.1M8.500 14.500a5 5 0 0 1 7 0M5.500 11.500a9 9 0 0 1 13 0M3 8a13 13 0 0 1 18 0",
} as const;

export type BlockIcon = keyof typeof OWN | (typeof STEP_KINDS)[number]["kind"];

const PATHS = { ...OWN, ...Object.fromEntries(STEP_KINDS.map(({ kind, icon }) => [kind, icon])) } as Record<BlockIcon, string>;

const SIZE_PX = 24;

/** A picture that says no more than the text behind it: screen readers pass over it. */
export class IconField extends Blockly.FieldImage {
  static readonly KIND = "field_motorcade_icon";

  static override fromJson(config: Blockly.FieldImageFromJsonConfig): IconField {
    return new this(config.src!, config.width!, config.height!, "");
  }

  override computeAriaLabel(): string {
    return "";
  }
}

/** The icon as a field of Blockly. */
export function iconOf(name: BlockIcon) {
  const svg = `<svg xmlns="http://www.w3.org/2000/svg" width="24" height="24" viewBox="0 0 24 24" fill="none" stroke="#fff" stroke-width="2" stroke-linecap="round" stroke-linejoin="round"><path d="${PATHS[name]}"/></svg>`;
  return { type: IconField.KIND, src: `data:image/svg+xml,${encodeURIComponent(svg)}`, width: SIZE_PX, height: SIZE_PX };
}
