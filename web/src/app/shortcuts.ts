/** The keys of the editors, as Blockly knows them, for the help dialog; and the key that opens it. */

import * as Blockly from "blockly/core";
import { create } from "zustand";
import type { DialogName } from "./Dialogs";

/** Which dialog is open: set by buttons, menus and keys alike. */
export const useDialog = create<{ open: DialogName | null }>(() => ({ open: null }));
const HELP = "list_shortcuts";

export function registerHelp(): void {
  const registry = Blockly.ShortcutRegistry.registry;
  if (registry.getRegistry()[HELP]) return;
  registry.register({
    name: HELP,
    keyCodes: [Blockly.utils.KeyCodes.SLASH],
    callback: () => {
      useDialog.setState({ open: "help" });
      return true;
    },
  });
}

export interface Shortcut {
  name: string;
  text: string;
  keys: string[];
}

const spelled = (key: string) =>
  key
    .split("+")
    .map((part) => (/^\d+$/.test(part) ? nameOfCode(Number(part)) : part))
    .join(" + ");

const NAMES: Record<number, string> = {
  8: "Backspace",
  9: "Tab",
  13: "Enter",
  27: "Esc",
  32: "Space",
  33: "Page Up",
  34: "Page Down",
  35: "End",
  36: "Home",
  37: "←",
  38: "↑",
  39: "→",
  40: "↓",
  46: "Delete",
  93: "Menu",
  121: "F10",
  191: "/",
};

function nameOfCode(code: number): string {
  return NAMES[code] ?? String.fromCharCode(code);
}

/** Blockly's shortcuts that have a text, each with its keys. */
export function editorShortcuts(): Shortcut[] {
  const registry = Blockly.ShortcutRegistry.registry;
  return Object.values(registry.getRegistry()).flatMap(({ name, displayText }) => {
    const text = typeof displayText === "function" ? displayText() : displayText;
    const keys = registry.getKeyCodesByShortcutName(name).map(spelled);
    return text && keys.length ? [{ name, text, keys: [...new Set(keys)] }] : [];
  });
}
