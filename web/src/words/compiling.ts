/** Send each change to the compiler. Only the newest counts: while an answer is awaited, older ones are skipped. */

import { RefusedError, request } from "../api/service";
import type { CompiledBlocks, EditorName, WorkspaceState } from "../api/types";
import { markDiagnostics } from "../blocks/marks";
import { read, workspaceOf } from "../blocks/workspaces";
import { inLanguage } from "../i18n";
import { notify } from "../state/dialogs";
import { useStudio } from "../state/studio";
import { sharedWords } from "./bits";

/** While an answer is awaited, edits are collected at least this often. */
const COLLECT_MS = 200;

let collecting: ReturnType<typeof setTimeout>;
let underWay = false;
let wanted = false;
/** When the blocks were sent last. */
let sentAt = 0;
/** So long at most nothing else is done before the words of an edit. */
const PRECEDENCE_MS = 50;

/** Whether the words of an edit are due at any moment, so that what takes long should wait. */
export const areWordsDue = (): boolean => underWay && performance.now() - sentAt < PRECEDENCE_MS;

/** The project whose blocks the editors were filled with. */
let filled = 0;
const edited = new Set<EditorName>();

/** Note that a block of the editor changed; edits that come while an answer is awaited are sent together after it. */
export function noteEdit(editor: EditorName): void {
  if (edited.size === 0) {
    // All events of one change come in one turn.
    if (!underWay) queueMicrotask(collectEdits);
    else collecting = setTimeout(collectEdits, COLLECT_MS);
  }
  edited.add(editor);
}

/** Copy what the editors hold into the store now, for callers that need the newest state. */
export function collectEdits(): void {
  clearTimeout(collecting);
  const changed: Partial<Record<EditorName, WorkspaceState>> = {};
  for (const editor of edited) {
    const state = workspaceOf(editor) && read(editor);
    if (state && JSON.stringify(state) !== JSON.stringify(useStudio.getState()[editor])) changed[editor] = state;
  }
  edited.clear();
  if (Object.keys(changed).length === 0) return;
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

/** The new answer, but the old objects where nothing changed, so that what shows them need not be drawn again. */
function sharedAnswer(before: CompiledBlocks | null, now: CompiledBlocks): CompiledBlocks {
  if (before === null) return now;
  const same = JSON.stringify(before.diagnostics) === JSON.stringify(now.diagnostics);
  // Words say the names of counters.
  const renamed = before.counters.join() !== now.counters.join();
  return { ...now, words: renamed ? now.words : sharedWords(before.words, now.words), diagnostics: same ? before.diagnostics : now.diagnostics };
}

async function compileNewest(): Promise<void> {
  wanted = true;
  if (underWay) return;
  underWay = true;
  while (wanted) {
    // Without `await`, an edit is sent before the page is drawn again, so that both happen at the same time.
    if (filled !== useStudio.getState().generation) await editorsFilled();
    wanted = false;
    const { leader, followers, profile } = useStudio.getState();
    try {
      sentAt = performance.now();
      const answer = await request("compile", { leader, followers, profile });
      // Another project was opened meanwhile.
      if (filled !== useStudio.getState().generation) continue;
      const compiled = sharedAnswer(useStudio.getState().compiled, answer);
      useStudio.setState({ compiled });
      markDiagnostics(compiled.diagnostics);
    } catch (error) {
      const { compiled } = useStudio.getState();
      const { sentence } = error instanceof RefusedError ? error : { sentence: null };
      // Until there are words again.
      if (sentence) notify(inLanguage(sentence), "error", undefined, (now) => now.compiled === compiled);
    }
    collectEdits();
  }
  underWay = false;
}

export function compileEveryChange(): void {
  useStudio.subscribe((now, before) => {
    const changed = now.leader !== before.leader || now.followers !== before.followers || now.profile !== before.profile;
    if (changed || (before.service === "gone" && now.service !== "gone")) void compileNewest();
  });
}
