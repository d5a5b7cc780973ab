/** Bring the blocks of an editor to another state and keep each block that stays: its place, comment and selection. */

import * as Blockly from "blockly/core";
import type { EditorName, WorkspaceState } from "../api/types";
import { endEdit, record } from "../state/history";
import { useStudio } from "../state/studio";
import { collectEdits, noteEdit } from "../words/compiling";
import { hatOf } from "./definitions";
import { ENDS } from "./endings";
import { drawAtOnce, EMPTY_FOLLOWERS, workspaceOf } from "./workspaces";

type State = Blockly.serialization.blocks.State;

/** The first of a row and all that follow it. */
function rowFrom<Each>(first: Each | null | undefined, next: (each: Each) => Each | null | undefined): Each[] {
  const row: Each[] = [];
  for (let each = first; each; each = next(each)) row.push(each);
  return row;
}

/** Give a block the fields of a state of its type, and the blocks inside it. */
function alter(block: Blockly.Block, state: State): void {
  // A state names no end of a step whose time ends it.
  const fields = block.getField(ENDS) ? { [ENDS]: "time", ...state.fields } : state.fields;
  for (const [name, value] of Object.entries(fields ?? {})) {
    if (String(block.getFieldValue(name)) !== String(value)) block.setFieldValue(value, name);
  }
  for (const { name, type, connection } of block.inputList) {
    const wanted = state.inputs?.[name]?.block;
    if (type === Blockly.inputs.inputTypes.STATEMENT) replaceRow(connection!, wanted);
    else if (type === Blockly.inputs.inputTypes.VALUE) replaceCondition(connection!, wanted);
  }
}

/** Replace the condition in a gap. */
function replaceCondition(connection: Blockly.Connection, wanted: State | undefined): void {
  const present = connection.targetBlock();
  if (!present && !wanted) return;
  const parts = JSON.stringify(present?.saveExtraState?.() ?? null);
  if (present?.type === wanted?.type && parts === JSON.stringify(wanted!.extraState ?? null)) {
    alter(present!, wanted!);
    return;
  }
  present?.dispose();
  if (!wanted) return;
  const made = Blockly.serialization.blocks.append(wanted, connection.getSourceBlock().workspace, { recordUndo: true });
  connection.connect(made.outputConnection!);
}

/** The block of the row that a state is of; infrared blocks, which are no steps, have no ids in a program. */
function take(left: Set<Blockly.Block>, state: State): Blockly.Block | undefined {
  const found = [...left].find((block) => block.type === state.type && (state.id === undefined || block.id === state.id));
  if (found) left.delete(found);
  return found;
}

/** Make a row of blocks at once, since Blockly measures and draws after each call. Returns its first and its last block. */
function makeRow(states: State[], workspace: Blockly.Workspace): [Blockly.Block, Blockly.Block] {
  const row = states.reduceRight<State | undefined>((next, state) => ({ ...state, next: next && { block: next } }), undefined)!;
  const first = Blockly.serialization.blocks.append(row, workspace, { recordUndo: true });
  return [first, rowFrom(first, (block) => block.getNextBlock()).at(-1)!];
}

/** Replace the row of blocks below a connection. Blocks that are switched off say nothing and stay. */
function replaceRow(connection: Blockly.Connection, row: State | undefined): void {
  const left = new Set(rowFrom(connection.targetBlock(), (block) => block.getNextBlock()).filter((block) => block.isEnabled()));
  const wanted = rowFrom(row, (state) => state.next?.block).map((state) => ({ state, block: take(left, state) }));
  for (const block of left) block.dispose(true);
  let at = connection;
  for (let k = 0; k < wanted.length; k++) {
    const { state, block: present } = wanted[k]!;
    for (let off = at.targetBlock(); off && !off.isEnabled(); off = at.targetBlock()) at = off.nextConnection!;
    if (present) {
      if (at.targetBlock() !== present) {
        present.unplug(true);
        at.connect(present.previousConnection!);
      }
      alter(present, state);
      at = present.nextConnection!;
      continue;
    }
    const missing = [state];
    while (wanted[k + 1]?.block === undefined && wanted[k + 1]) missing.push(wanted[++k]!.state);
    const [first, last] = makeRow(missing, at.getSourceBlock().workspace);
    at.connect(first.previousConnection!);
    at = last.nextConnection!;
  }
}

const DEFINE = "motorcade_define";

/** Bring the blocks that define others to these. */
function alterDefined(workspace: Blockly.Workspace, wanted: State[]): void {
  const left = new Set(workspace.getBlocksByType(DEFINE).filter((block) => block.isEnabled()));
  for (const state of wanted) {
    const found = [...left].find((block) => block.getFieldValue("NAME") === state.fields?.NAME);
    if (found) {
      left.delete(found);
      alter(found, state);
    } else {
      Blockly.serialization.blocks.append(state, workspace, { recordUndo: true });
    }
  }
  for (const block of left) block.dispose();
}

/** Bring an editor to a state that a program was written to: its hat and the row below, and own blocks. Others stay. */
function alterEditor(editor: EditorName, state: WorkspaceState): void {
  const workspace = workspaceOf(editor);
  const [wanted, ...defined] = (state as { blocks?: { blocks?: State[] } }).blocks?.blocks ?? [];
  const [hat] = workspace?.getBlocksByType(hatOf(editor)) ?? [];
  if (!hat || !wanted) return;
  drawAtOnce(workspace!, () => {
    alter(hat, wanted);
    replaceRow(hat.nextConnection!, wanted.next?.block);
    alterDefined(workspace!, defined);
  });
  noteEdit(editor);
}

/** Bring both editors to these blocks, as one change for undo. */
export function alterBlocks(leader: WorkspaceState, followers: WorkspaceState | null): void {
  const before = useStudio.getState().followers;
  const group = Blockly.Events.getGroup();
  Blockly.Events.setGroup(true);
  alterEditor("leader", leader);
  if (followers && before) alterEditor("followers", followers);
  Blockly.Events.setGroup(group);
  collectEdits();
  if (Boolean(followers) === Boolean(before)) return;
  if (followers) useStudio.setState({ followers, parkedFollowers: null });
  else parkFollowers();
  recordFollowers(Boolean(followers));
}

/** Put the followers' blocks aside: only the leader is programmed. */
export function parkFollowers(): void {
  collectEdits();
  useStudio.setState(({ followers }) => ({ followers: null, parkedFollowers: followers, editor: "leader" }));
}

export function unparkFollowers(): void {
  const { followers, parkedFollowers } = useStudio.getState();
  if (followers !== null) return;
  useStudio.setState({ followers: parkedFollowers ?? EMPTY_FOLLOWERS, parkedFollowers: null, editor: "followers" });
}

/** Note for undo that the followers are programmed from now on, or no longer. */
export function recordFollowers(on: boolean): void {
  const [undo, redo] = on ? [parkFollowers, unparkFollowers] : [unparkFollowers, parkFollowers];
  endEdit();
  record({ key: "followers", undo, redo });
  endEdit();
}
