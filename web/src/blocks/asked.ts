/** Which blocks and conditions a selection stands for, and the block of a word's condition. */

import * as Blockly from "blockly/core";
import type { EditorName } from "../api/types";
import { FLOW_CONDITIONS, SENSES } from "../generated/steps";
import { type Asked, askedKey, COMPARISONS } from "../words/deciding";
import { editorWith, workspaceOf } from "./workspaces";

/** What a block of a condition asks, as words say it; null where it is made of other conditions. */
function askedIn(block: Blockly.Block): Asked | null {
  const kind = block.type.replace("motorcade_when_", "") as Asked["kind"];
  const field = { obstacle: "LEVEL", voice: "COMMAND", floor: "WHERE", counter: "IS" }[kind as string];
  if (!FLOW_CONDITIONS.includes(kind)) return null;
  const value: unknown = field ? block.getFieldValue(field) : null;
  const levels: Partial<Record<string, readonly unknown[]>> = { ...SENSES, counter: COMPARISONS };
  return { kind, level: Math.max(0, levels[kind]?.findIndex((level) => String(level) === value) ?? 0) };
}

/** The blocks of the conditions in a block, without those of the steps inside it. */
function conditionsIn(block: Blockly.Block): Blockly.Block[] {
  const inputs = block.inputList.filter(({ type }) => type === Blockly.inputs.inputTypes.VALUE);
  const found = inputs.flatMap(({ connection }) => connection?.targetBlock() ?? []);
  return found.flatMap((condition) => [condition, ...conditionsIn(condition)]);
}

/** The block of a condition that a step asks, by what its word says of it; null where there is none. */
export function conditionOf(editor: EditorName, step: string, wanted: Asked): string | null {
  const block = workspaceOf(editorWith(editor, step))?.getBlockById(step);
  const matches = block ? conditionsIn(block).filter((condition) => askedIn(condition)?.kind === wanted.kind) : [];
  return (matches.find((condition) => askedIn(condition)!.level === wanted.level) ?? matches[0])?.id ?? null;
}

/** The ids of the block and of all blocks inside it, without the blocks below it; for a condition, what stands for it. */
export function withInner(editor: EditorName, id: string): Set<string> {
  const block = workspaceOf(editor)?.getBlockById(id);
  if (!block) return new Set();
  if (block.outputConnection) {
    let step = block.getParent();
    while (step?.outputConnection) step = step.getParent();
    const asked = [block, ...conditionsIn(block)].flatMap((condition) => askedIn(condition) ?? []);
    return new Set(asked.map((each) => askedKey(step?.id ?? "", each)));
  }
  const after = new Set(block.getNextBlock()?.getDescendants(false));
  return new Set(block.getDescendants(false).filter((each) => !after.has(each)).map((each) => each.id));
}
