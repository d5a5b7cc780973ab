/** Sends each change to the compiler: the newest at once, those that it overtook never. */

import * as api from "../api/http";
import type { EditorName } from "../api/types";
import { tell } from "../app/telling";
import { useStudio } from "../app/store";
import { markDiagnostics } from "../blocks/marks";
import { read, workspaceOf } from "../blocks/workspaces";
import { spoken } from "../i18n";

/** Long enough to take the events of one drag together, short enough not to be felt. */
const GATHER_MS = 16;
const EDITED = "motorcade:edited";
export const SHOWN = "motorcade:edit-to-words";

let gathering: ReturnType<typeof setTimeout> | undefined;
let underWay = false;
let wanted = false;
const touchedEditors = new Set<EditorName>();

/** Some block of the editor changed. */
export function touched(editor: EditorName): void {
  if (touchedEditors.size === 0) performance.mark(EDITED);
  touchedEditors.add(editor);
  clearTimeout(gathering);
  gathering = setTimeout(flush, GATHER_MS);
}

/** Takes what the editors hold into the store now, for who can't wait for the next compilation. */
export function flush(): void {
  clearTimeout(gathering);
  for (const editor of touchedEditors) {
    if (workspaceOf(editor)) useStudio.setState({ [editor]: read(editor) });
  }
  touchedEditors.clear();
}

async function compileNewest(): Promise<void> {
  wanted = true;
  if (underWay) return;
  underWay = true;
  while (wanted) {
    wanted = false;
    const { leader, followers, profile } = useStudio.getState();
    try {
      const compiled = await api.compile({ leader, followers, profile });
      useStudio.setState({ compiled });
      markDiagnostics(compiled.diagnostics);
    } catch (error) {
      if (error instanceof api.RefusedError) tell(spoken(error.sentence), "error");
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
  if (performance.getEntriesByName(EDITED).length === 0) return;
  requestAnimationFrame(() => {
    if (performance.getEntriesByName(EDITED).length) performance.measure(SHOWN, EDITED);
    performance.clearMarks(EDITED);
  });
}
