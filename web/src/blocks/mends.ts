/** Mend a wrong block by the one value that would do, and tell which block is wrong. */

import i18next from "i18next";
import type { Diagnostic } from "../api/types";
import type { Mend } from "../generated/messages";
import { inLanguage } from "../i18n";
import { notify } from "../state/dialogs";
import { useStudio } from "../state/studio";
import { hatOf } from "./definitions";
import { showBlock, workspaceOf } from "./workspaces";

/** Set the value; a diagnostic without a block is about the settings of its editor's first block. */
export function mend({ block, editor }: Pick<Diagnostic, "block" | "editor">, { field, value }: Mend): void {
  if (editor === null) return;
  const workspace = workspaceOf(editor);
  const found = block === null ? workspace?.getBlocksByType(hatOf(editor))[0] : workspace?.getBlockById(block);
  found?.setFieldValue(value, field);
}

/** Say which block keeps the cars from driving, and lead to it; false where none does. */
export function tellWrongBlock(): boolean {
  const wrong = useStudio.getState().compiled?.diagnostics.find(({ severity }) => severity === "error");
  if (!wrong) return false;
  const { block, editor, sentence } = wrong;
  const action = block !== null && editor !== null ? { label: i18next.t("mat.showBlock"), run: () => showBlock(editor, block) } : undefined;
  if (action) action.run();
  notify(i18next.t("mat.wrongProgram", { editor: editor ? i18next.t(`editors.${editor}`) : "", sentence: inLanguage(sentence) }), "warning", action);
  return true;
}
