/** Blocks by what they say. */

import type { BlockSvg, WorkspaceSvg } from "blockly/core";
import type { EditorName } from "../api/types";
import { workspaceOf } from "./workspaces";

const plain = (text: string) => text.toLocaleLowerCase().replace(/\s+/g, " ").trim();

/** What stands on the block itself, without the blocks inside it. */
export function textOf(block: BlockSvg): string {
  const fields = block.inputList.flatMap((input) => (input.isVisible() ? input.fieldRow : []));
  return plain(fields.map((field) => field.getText()).join(" "));
}

/** The blocks whose text, comment or kind holds all words of the query, from top to bottom. */
export function findBlocks(workspace: WorkspaceSvg, query: string): BlockSvg[] {
  const words = plain(query).split(" ").filter(Boolean);
  if (words.length === 0) return [];
  return workspace.getAllBlocks(true).filter((block) => {
    const text = `${textOf(block)} ${plain(block.getCommentText() ?? "")} ${block.type.replace("motorcade_", "")}`;
    return words.every((word) => text.includes(word));
  });
}

/** What the block with this id says; nothing where it is gone. */
export function findText(editor: EditorName, id: string): string {
  const block = workspaceOf(editor)?.getBlockById(id);
  return block ? textOf(block) : "";
}
