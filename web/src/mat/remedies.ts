/** Carry out what the answer to 'Why?' names, as an edit that can be undone. The service computes what changes. */

import * as Blockly from "blockly/core";
import { request } from "../api/service";
import { hatOf } from "../blocks/definitions";
import { workspaceOf } from "../blocks/workspaces";
import type { RemedyChanges, RemedyOrder, Why } from "../generated/messages";
import { say } from "../i18n";
import { attempt } from "../projects/actions";
import { notify } from "../state/dialogs";
import { endEdit } from "../state/history";
import { useStudio } from "../state/studio";
import { collectEdits } from "../words/compiling";
import { setRange } from "./actions";
import { choose, editMat } from "./store";

type Remedy = RemedyOrder["remedy"];

/** What a button does about the answer of a car; null where nothing that it could do is sure to help. */
export function remedyOf({ remedy }: Why): Remedy | null {
  // Which blocks followers shall have is for the pupil to say.
  return remedy === "" || remedy === "followers" ? null : remedy;
}

/** The remedies that change the blocks alone: a mission's mat and range are fixed. */
export function changesBlocks(remedy: Remedy): boolean {
  return remedy === "forward" || remedy === "listen";
}

/** Carry out the remedy of a car's answer. */
export async function carryOut(car: number, why: Why): Promise<void> {
  const remedy = remedyOf(why);
  if (!remedy) return;
  collectEdits();
  const { mat, followers, rangeMm, profile } = useStudio.getState();
  const answer = await attempt(() => request("remedy", { remedy, value: why.value, car, mat, followers, profile, range_mm: rangeMm }));
  // Refused, or the mat was changed meanwhile, by hand.
  if (!answer || useStudio.getState().mat !== mat) return;
  apply(answer);
  // The cars behind the one that was taken away have other numbers now.
  if (remedy === "remove-car" && why.value < car) choose({ car: car - 1 });
}

function apply({ mat, range_mm: rangeMm, fields }: RemedyChanges): void {
  endEdit();
  if (mat) editMat(mat);
  if (rangeMm !== null) setRange(rangeMm);
  if (!mat && rangeMm === null && !fields.length) notify(say("mat.remedies.noRoom"), "warning");
  const workspace = workspaceOf("followers");
  Blockly.Events.setGroup(true);
  for (const { block, field, value } of fields) {
    const found = block === null ? workspace?.getBlocksByType(hatOf("followers"))[0] : workspace?.getBlockById(block);
    found?.setFieldValue(value, field);
  }
  Blockly.Events.setGroup(false);
  endEdit();
}
