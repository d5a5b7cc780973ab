/** Sends each change to the compiler: the newest at once, those that it overtook never. */

import * as api from "../api/http";
import type { EditorName, WorkspaceState } from "../api/types";
import { tell } from "../app/telling";
import { useStudio } from "../app/store";
import { markDiagnostics } from "../blocks/marks";
import { read, workspaceOf } from "../blocks/workspaces";
import { inLanguage } from "../i18n";
import { sharedWords } from "./bits";

/** After an edit, for how long others are taken together with the next one. */
const GATHER_MS = 50;
export const SHOWN = "motorcade:edit-to-words";

let gathering: ReturnType<typeof setTimeout> | undefined;
let underWay = false;
let wanted = false;
/** When the oldest edit was made that is not on its way yet, and that of the words in the store. */
let editedAt: number | null = null;
let answersEditOf: number | null = null;
let touchedAt = 0;
const touchedEditors = new Set<EditorName>();

/** Some block of the editor changed. What follows on an edit at once, as while somebody types, is gathered. */
export function touched(editor: EditorName): void {
  if (touchedEditors.size === 0) touchedAt = performance.now();
  touchedEditors.add(editor);
  // All events of one change come in one turn.
  if (gathering === undefined) queueMicrotask(take);
}

function take(): void {
  flush();
  gathering = setTimeout(() => {
    gathering = undefined;
    if (touchedEditors.size) take();
  }, GATHER_MS);
}

/** Takes what the editors hold into the store now, for who can't wait for the next compilation. */
export function flush(): void {
  clearTimeout(gathering);
  gathering = undefined;
  const changed: Partial<Record<EditorName, WorkspaceState>> = {};
  for (const editor of touchedEditors) {
    const state = workspaceOf(editor) && read(editor);
    if (state && JSON.stringify(state) !== JSON.stringify(useStudio.getState()[editor])) changed[editor] = state;
  }
  touchedEditors.clear();
  if (Object.keys(changed).length === 0) return;
  editedAt ??= touchedAt;
  useStudio.setState(changed);
}

async function compileNewest(): Promise<void> {
  wanted = true;
  if (underWay) return;
  underWay = true;
  while (wanted) {
    wanted = false;
    const { leader, followers, profile } = useStudio.getState();
    const edit = editedAt;
    editedAt = null;
    try {
      const answer = await api.compile({ leader, followers, profile });
      const compiled = { ...answer, words: sharedWords(useStudio.getState().compiled?.words ?? [], answer.words) };
      answersEditOf = edit;
      useStudio.setState({ compiled });
      markDiagnostics(compiled.diagnostics);
    } catch (error) {
      if (error instanceof api.RefusedError) tell(inLanguage(error.sentence), "error");
    }
  }
  underWay = false;
}

export function compileEveryChange(): void {
  useStudio.subscribe((now, before) => {
    const changed = now.leader !== before.leader || now.followers !== before.followers || now.profile !== before.profile;
    if (changed || (before.serverGone && !now.serverGone)) void compileNewest();
  });
}

/** Called when the words of the newest edit stand in the page; the browser's performance tools list the times. */
export function wordsShown(): void {
  const start = answersEditOf;
  answersEditOf = null;
  if (start !== null) requestAnimationFrame(() => performance.measure(SHOWN, { start }));
}
