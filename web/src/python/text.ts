/** The Python text beside the blocks: an edit of one is shown in the other. */

import { create } from "zustand";
import { RefusedError, request } from "../api/service";
import type { Diagnostic } from "../api/types";
import { alterBlocks } from "../blocks/rows";
import type { BlockPlace, TextPlace } from "../generated/messages";
import { inLanguage } from "../i18n";
import { notify } from "../state/dialogs";
import { useStudio } from "../state/studio";
import { collectEdits } from "../words/compiling";

interface PythonText {
  text: string;
  /** Where each block stands in the text. */
  places: readonly BlockPlace[];
  diagnostics: readonly Diagnostic[];
}

export const usePython = create<PythonText>(() => ({ text: "", places: [], diagnostics: [] }));

/** For how long what is typed in quick succession is collected. */
const COLLECT_MS = 60;
let typing: ReturnType<typeof setTimeout> | undefined;
/** Counts the edits of the text: answers to older ones are dropped. */
let edits = 0;
let asking = false;
let askAgain = false;

function blocksNow() {
  collectEdits();
  const { leader, followers, profile } = useStudio.getState();
  return { leader, followers, profile };
}

/** The user changed the text. */
export function editText(text: string): void {
  edits += 1;
  usePython.setState({ text });
  useStudio.setState({ python: text });
  clearTimeout(typing);
  typing = setTimeout(() => void readText(edits), COLLECT_MS);
}

/** The user has part of the text replaced. */
export function replaceText(place: TextPlace, written: string): void {
  const { text } = usePython.getState();
  const lines = text.split("\n");
  const offset = (line: number, column: number) => lines.slice(0, line - 1).reduce((sum, each) => sum + each.length + 1, 0) + column - 1;
  editText(text.slice(0, offset(place.line, place.column)) + written + text.slice(offset(place.end_line, place.end_column)));
}

async function readText(edit: number): Promise<void> {
  const { text } = usePython.getState();
  const answer = await request("python-to-blocks", { ...blocksNow(), text }).catch((error: unknown) => {
    // A text that the service doesn't take, such as one that is too long, is the user's to change.
    if (error instanceof RefusedError) notify(inLanguage(error.sentence), "error");
    return null;
  });
  if (edit !== edits) return;
  typing = undefined;
  if (!answer) return;
  if (!answer.leader) {
    // The blocks stay, and so does the text: from these blocks it would be written without what was typed.
    usePython.setState({ places: [], diagnostics: answer.diagnostics });
    return;
  }
  alterBlocks(answer.leader, answer.followers);
  await updateText();
}

/** Bring the text up to date with the blocks; `anew` writes it without what it was before. */
export async function updateText(anew = false): Promise<void> {
  askAgain = true;
  if (asking) return;
  asking = true;
  while (askAgain) {
    askAgain = false;
    const edit = edits;
    // A failed request is told by the compiler's, which runs at the same time.
    const answer = await request("blocks-to-python", { ...blocksNow(), text: anew ? "" : usePython.getState().text }).catch(() => null);
    if (!answer || edit !== edits || typing !== undefined) continue;
    usePython.setState({ text: answer.text, places: answer.places, diagnostics: answer.diagnostics });
    const { python } = useStudio.getState();
    if (python !== null && python !== answer.text) useStudio.setState({ python: answer.text });
  }
  asking = false;
}

/** Follow the blocks and the projects that are opened until the returned function is called. */
export function followBlocks(): () => void {
  usePython.setState({ text: useStudio.getState().python ?? "" });
  void updateText();
  return useStudio.subscribe((now, before) => {
    if (now.generation !== before.generation) {
      edits += 1;
      clearTimeout(typing);
      typing = undefined;
      usePython.setState({ text: now.python ?? "", places: [], diagnostics: [] });
    } else if (now.leader === before.leader && now.followers === before.followers && now.profile === before.profile) return;
    if (typing === undefined) void updateText();
  });
}
