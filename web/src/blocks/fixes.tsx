/** Correct a wrong block by one of the values that would do, and tell which block is wrong. */

import { type Block, Events } from "blockly/core";
import type { Diagnostic } from "../api/types";
import type { Fix } from "../generated/messages";
import { inLanguage, say } from "../i18n";
import { notify } from "../state/dialogs";
import { useStudio } from "../state/studio";
import { replaceText } from "../python/text";
import { TextButton } from "../ui/controls";
import { hatOf } from "./definitions";
import { showBlock, workspaceOf } from "./workspaces";

/** Set the value or do the edit; a diagnostic without a block is about the settings of its editor's first block. */
export function applyFix(diagnostic: Diagnostic, { field, value, block, place }: Fix): void {
  if (field === "TEXT") {
    const where = place ?? diagnostic.place;
    if (where) replaceText(where, String(value));
    return;
  }
  if (diagnostic.editor === null) return;
  const workspace = workspaceOf(diagnostic.editor);
  const id = block ?? diagnostic.block;
  const found = id === null ? workspace?.getBlocksByType(hatOf(diagnostic.editor))[0] : workspace?.getBlockById(id);
  if (field === "DELETE") found?.dispose(true);
  else if (field === "BEHIND") moveBehindParent(found);
  else found?.setFieldValue(value, field);
}

/** Put a block behind the one that it stands in; the blocks below it stay inside. */
function moveBehindParent(block: Block | null | undefined): void {
  const around = block?.getSurroundParent()?.nextConnection;
  if (!block?.previousConnection || !around) return;
  Events.setGroup(true);
  block.unplug(true);
  around.connect(block.previousConnection);
  Events.setGroup(false);
}

/** Say which block keeps the cars from driving, and lead to it; false where none does. */
export function tellWrongBlock(): boolean {
  const wrong = useStudio.getState().compiled?.diagnostics.find(({ severity }) => severity === "error");
  if (!wrong) return false;
  const { block, editor, sentence } = wrong;
  const action = block !== null && editor !== null ? { label: say("mat.showBlock"), run: () => showBlock(editor, block) } : undefined;
  if (action) action.run();
  const text = say("mat.wrongProgram", { editor: editor ? say(`editors.${editor}`) : "", sentence: inLanguage(sentence) });
  const isStill = (each: Diagnostic) => each.severity === "error" && each.block === block && each.sentence.en === sentence.en;
  notify(text, "warning", action, ({ compiled }) => compiled?.diagnostics.some(isStill) ?? false);
  return true;
}

/** A button for each value that would fix a wrong block. */
export function FixButtons({ diagnostic }: { diagnostic: Diagnostic }) {
  return (diagnostic.fixes ?? []).map((each) => (
    <TextButton key={`${each.field} ${each.value}`} primary onPress={() => applyFix(diagnostic, each)}>
      {inLanguage(each.sentence)}
    </TextButton>
  ));
}
