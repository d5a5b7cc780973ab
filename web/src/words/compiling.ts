/** Send each change to the compiler. Only the newest counts: while an answer is awaited, older ones are skipped. */

import * as api from "../api/requests";
import type { EditorName, WorkspaceState } from "../api/types";
import { markDiagnostics } from "../blocks/marks";
import { read, workspaceOf } from "../blocks/workspaces";
import { inLanguage } from "../i18n";
import { notify } from "../state/dialogs";
import { useStudio } from "../state/studio";
import { sharedWords } from "./bits";

/** For how long the edits that follow one are collected before they are sent together. */
const COLLECT_MS = 50;
/** The name under which the browser's performance tools list the times from edits to words. */
const MEASURE = "motorcade:edit-to-words";

let collecting: ReturnType<typeof setTimeout> | undefined;
let underWay = false;
let wanted = false;
/** The time of the oldest edit that was not sent yet, and of the edit that the words in the store answer. */
let editedAt: number | null = null;
let answersEditOf: number | null = null;
let firstEditAt = 0;
/** The project whose blocks the editors were filled with. */
let filled = 0;
const edited = new Set<EditorName>();

/** Note that a block of the editor changed; edits in quick succession, as while typing, are sent together. */
export function noteEdit(editor: EditorName): void {
  if (edited.size === 0) firstEditAt = performance.now();
  edited.add(editor);
  // All events of one change come in one turn.
  if (collecting === undefined) queueMicrotask(collect);
}

function collect(): void {
  collectEdits();
  collecting = setTimeout(() => {
    collecting = undefined;
    if (edited.size) collect();
  }, COLLECT_MS);
}

/** Copy what the editors hold into the store now, for callers that need the newest state. */
export function collectEdits(): void {
  clearTimeout(collecting);
  collecting = undefined;
  const changed: Partial<Record<EditorName, WorkspaceState>> = {};
  for (const editor of edited) {
    const state = workspaceOf(editor) && read(editor);
    if (state && JSON.stringify(state) !== JSON.stringify(useStudio.getState()[editor])) changed[editor] = state;
  }
  edited.clear();
  if (Object.keys(changed).length === 0) return;
  editedAt ??= firstEditAt;
  useStudio.setState(changed);
}

/**
 * Wait until the editors hold the open project, which they are filled with in the turn that opens it. They give ids to
 * the blocks that have none, and only a diagnostic of a block with an id leads to its block.
 */
async function editorsFilled(): Promise<void> {
  while (filled !== useStudio.getState().generation) {
    filled = useStudio.getState().generation;
    await new Promise((resolve) => setTimeout(resolve));
  }
}

async function compileNewest(): Promise<void> {
  wanted = true;
  if (underWay) return;
  underWay = true;
  while (wanted) {
    await editorsFilled();
    wanted = false;
    const { leader, followers, profile } = useStudio.getState();
    const edit = editedAt;
    editedAt = null;
    try {
      const answer = await api.compile({ leader, followers, profile });
      // Another project was opened meanwhile.
      if (filled !== useStudio.getState().generation) continue;
      const compiled = { ...answer, words: sharedWords(useStudio.getState().compiled?.words ?? [], answer.words) };
      answersEditOf = edit;
      useStudio.setState({ compiled });
      markDiagnostics(compiled.diagnostics);
    } catch (error) {
      if (error instanceof api.RefusedError) notify(inLanguage(error.sentence), "error");
    }
  }
  underWay = false;
}

export function compileEveryChange(): void {
  useStudio.subscribe((now, before) => {
    const changed = now.leader !== before.leader || now.followers !== before.followers || now.profile !== before.profile;
    if (changed || (before.service === "gone" && now.service !== "gone")) void compileNewest();
  });
}

/** To be called when the words of the newest edit are shown: it measures the time since the edit. */
export function measureEdit(): void {
  const start = answersEditOf;
  answersEditOf = null;
  if (start !== null) requestAnimationFrame(() => performance.measure(MEASURE, { start }));
}
