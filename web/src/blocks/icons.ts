/** The icon that stands before a block's text, drawn in the colour of the text. */

import * as Blockly from "blockly/core";

const PATHS = {
  leader: "m12 3 2.6 5.6 6.1.7-4.5 4.200 1.200 6L12 16.500 6.600 19.500l1.200-6L3.300 9.300l6.100-.7z",
  followers: "M7 4l4 7H3zM17 4l4 7h-8zM12 13l4 7H8z",
  drive: "M4 15v-3l3-5h8l4 5h1v3zM7 15a2 2 0 1 0 0 4 2 2 0 0 0 0-4ZM17 15a2 2 0 1 0 0 4 2 2 0 0 0 0-4Z",
  wait: "M7 3h10M7 21h10M8 3c0 5 8 5 8 9s-8 4-8 9M16 3c0 5-8 5-8 9s8 4 8 9",
  led: "M9 18h6M10 21h4M12 3a6 6 0 0 0-3.500 10.900V16h7v-2.100A6 6 0 0 0 12 3Z",
  avoid: "M12 3l8 3v6c0 5-4 8-8 9-4-1-8-4-8-9V6zM9 9l6 6M15 9l-6 6",
  voice: "M12 3a3 3 0 0 0-3 3v6a3 3 0 0 0 6 0V6a3 3 0 0 0-3-3ZM6 11a6 6 0 0 0 12 0M12 17v4M9 21h6",
  pir: "M12 4a3 3 0 1 0 0 6 3 3 0 0 0 0-6ZM5.500 20a6.500 6.500 0 0 1 13 0",
  together: "M4 6h16M4 12h16M4 18h16M8 3v18",
  repeat: "M4 11a7 7 0 0 1 12-4.500L19 9M19 4v5h-5M20 13a7 7 0 0 1-12 4.500L5 15M5 20v-5h5",
  infrared: "M12 18v.1M8.500 14.500a5 5 0 0 1 7 0M5.500 11.500a9 9 0 0 1 13 0M3 8a13 13 0 0 1 18 0",
} as const;

export type BlockIcon = keyof typeof PATHS;

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
