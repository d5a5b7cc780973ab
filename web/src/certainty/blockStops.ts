/** A block's menu lets the world stop when a car begins the block. */

import * as Blockly from "blockly/core";
import i18next from "i18next";
import { findText } from "../blocks/workspaces";
import { addStop, canStopAt } from "./stops";

const ID = "motorcade-stop";

/** Add the entry to the menus of blocks. To be called once. */
export function registerBlockStops(): void {
  const menu = Blockly.ContextMenuRegistry.registry;
  if (menu.getItem(ID)) return;
  menu.register({
    id: ID,
    weight: 1,
    scopeType: Blockly.ContextMenuRegistry.ScopeType.BLOCK,
    displayText: () => i18next.t("stops.whenBegun"),
    preconditionFn: ({ block }) => (block && canStopAt(block.id) ? "enabled" : "hidden"),
    callback: ({ block }) => {
      const editor = block && canStopAt(block.id);
      if (editor) addStop({ condition: { kind: "block" }, block: { editor, id: block.id, text: findText(editor, block.id) } });
    },
  });
}
