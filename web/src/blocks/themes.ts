/** What blocks look like in each of the page's themes. */

import * as Blockly from "blockly/core";
import type { ThemeName } from "../state/settings";

type Style = "hat" | "drive" | "light" | "sense" | "order" | "infrared" | "decide" | "count" | "tell" | "mine";
type Colours = Record<Style, [primary: string, secondary: string, tertiary: string]>;

const CALM: Colours = {
  hat: ["#38465c", "#4d5d76", "#28344a"],
  drive: ["#2a62c9", "#4a7bd6", "#1d4a9e"],
  light: ["#9a5b00", "#b97a22", "#774600"],
  sense: ["#0b7667", "#2b9081", "#075a4e"],
  order: ["#7446ba", "#8c64c9", "#593394"],
  infrared: ["#b02a5b", "#c74f7a", "#8b1f47"],
  decide: ["#2d7a3e", "#4d9460", "#1f5a2c"],
  count: ["#a8470a", "#c2672e", "#7f3507"],
  tell: ["#b02a5b", "#c74f7a", "#8b1f47"],
  mine: ["#8a3a94", "#a45bad", "#682a70"],
};

const STARK: Colours = {
  hat: ["#000000", "#333333", "#ffffff"],
  drive: ["#0033a8", "#1a4fc4", "#ffffff"],
  light: ["#663800", "#804a08", "#ffffff"],
  sense: ["#00473d", "#086052", "#ffffff"],
  order: ["#47128f", "#5d2aa6", "#ffffff"],
  infrared: ["#7a0033", "#941a4c", "#ffffff"],
  decide: ["#0d4a1c", "#1f632f", "#ffffff"],
  count: ["#6b2a00", "#854008", "#ffffff"],
  tell: ["#7a0033", "#941a4c", "#ffffff"],
  mine: ["#541a5c", "#6d2e76", "#ffffff"],
};

const GROUNDS: Record<ThemeName, Blockly.Theme.ComponentStyle> = {
  light: ground("#fbfcfe", "#eef2f8", "#1b2536", "#e2e8f1", "#5b6b84", "#2457c5"),
  dark: ground("#171d28", "#1f2735", "#e8edf5", "#283244", "#8a9ab3", "#8fb4ff"),
  contrast: ground("#000000", "#000000", "#ffffff", "#1a1a1a", "#ffffff", "#ffe600"),
};

function ground(
  workspace: string,
  toolbox: string,
  text: string,
  flyout: string,
  scrollbar: string,
  cursor: string,
): Blockly.Theme.ComponentStyle {
  return {
    workspaceBackgroundColour: workspace,
    toolboxBackgroundColour: toolbox,
    toolboxForegroundColour: text,
    flyoutBackgroundColour: flyout,
    flyoutForegroundColour: text,
    flyoutOpacity: 0.97,
    scrollbarColour: scrollbar,
    scrollbarOpacity: 0.5,
    insertionMarkerColour: cursor,
    insertionMarkerOpacity: 0.5,
    cursorColour: cursor,
    selectedGlowColour: cursor,
    selectedGlowOpacity: 1,
  };
}

export function themeOf(name: ThemeName): Blockly.Theme {
  const colours = Object.entries(name === "contrast" ? STARK : CALM);
  const blockStyles = colours.map(([style, [colourPrimary, colourSecondary, colourTertiary]]) => [
    `${style}_blocks`,
    { colourPrimary, colourSecondary, colourTertiary, hat: style === "hat" ? "cap" : "" },
  ]);
  return Blockly.Theme.defineTheme(`motorcade-${name}`, {
    name: `motorcade-${name}`,
    blockStyles: Object.fromEntries(blockStyles) as Record<string, Blockly.Theme.BlockStyle>,
    // The dark ones could hardly be told apart as small as a drawer's sign.
    categoryStyles: Object.fromEntries(Object.entries(CALM).map(([style, [colour]]) => [`${style}_category`, { colour }])),
    componentStyles: GROUNDS[name],
    fontStyle: { family: '"Noto Sans SC", "Noto Sans CJK SC", system-ui, sans-serif', weight: "500", size: 12 },
  });
}
