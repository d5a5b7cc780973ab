/** One undo and one redo for everything that is edited: blocks, mat, and which cars are programmed. */

import { create } from "zustand";

interface Edit {
  /** Edits with the same key one after another, such as the steps of a drag, are undone together; null joins none. */
  key: string | null;
  undo: () => void;
  redo: () => void;
}

interface History {
  done: readonly Edit[];
  undone: readonly Edit[];
}

const MOST = 500;
const EMPTY: History = { done: [], undone: [] };

export const useHistory = create<History>(() => EMPTY);

/** Whether the next edit may join the last one. */
let joins = false;

/** Note an edit that was made; what was undone before it can't be redone any more. */
export function record(edit: Edit): void {
  const { done } = useHistory.getState();
  const last = done.at(-1);
  const joined = joins && edit.key !== null && last?.key === edit.key ? { ...edit, undo: last.undo } : edit;
  useHistory.setState({ done: [...(joined === edit ? done : done.slice(0, -1)), joined].slice(-MOST), undone: [] });
  joins = true;
}

/** The next edit is a new one, even if it has the same key. */
export function endEdit(): void {
  joins = false;
}

/** Another project was opened: it has no earlier versions. */
export function forgetEdits(): void {
  joins = false;
  useHistory.setState(EMPTY);
}

/** Ends a move that goes on, such as that of a block; answers whether there was one. */
let endMove = (): boolean => false;

/** Say how a move is ended: an undo or a redo meanwhile ends the move, and does nothing else. */
export function endMovesBy(end: () => boolean): void {
  endMove = end;
}

/** Take the newest edit from one list to the other. */
function step(from: keyof History, to: keyof History, act: "undo" | "redo"): void {
  if (endMove()) return;
  const edits = useHistory.getState();
  const edit = edits[from].at(-1);
  joins = false;
  if (!edit) return;
  useHistory.setState({ [from]: edits[from].slice(0, -1), [to]: [...edits[to], edit] });
  edit[act]();
}

export const undo = () => step("done", "undone", "undo");
export const redo = () => step("undone", "done", "redo");
