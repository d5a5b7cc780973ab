/** Carry out what the answer to 'Why?' names. */

import * as Blockly from "blockly/core";
import { hatOf } from "../blocks/definitions";
import { workspaceOf } from "../blocks/workspaces";
import type { Why } from "../generated/messages";
import { endEdit } from "../state/history";
import { useStudio } from "../state/studio";
import { place, setRange, startBeside } from "./actions";
import { withLoss } from "./document";
import type { Session } from "./session";
import { editMat } from "./store";

/** The cures that a button can carry out. */
export const CURES = ["range_mm", "move", "leader", "forward", "loss"] as const;
export type CureName = (typeof CURES)[number];

/** The scale of the range's slider, and the longest range that a world takes. */
const RANGE_STEP_MM = 50;
const LONGEST_RANGE_MM = 5000;

/** What a button does about the answer of a car; null where nothing that it could do would help. */
export function cureOf({ cure, car, value }: Why): CureName | null {
  // Where infrared can't reach so far, the car comes nearer.
  if (cure === "range_mm" && value > LONGEST_RANGE_MM) return car === null ? null : "move";
  return CURES.find((name) => name === cure) ?? null;
}

/** Carry out the cure of a car's answer, as an edit that can be undone. */
export function carryOut(session: Session, car: number, why: Why): void {
  endEdit();
  switch (cureOf(why)) {
    case "range_mm":
      setRange(Math.ceil(why.value / RANGE_STEP_MM) * RANGE_STEP_MM);
      break;
    case "move":
      if (why.car !== null) startBeside(session, car, why.car);
      break;
    case "leader":
      place(session, "leader", besideOf(session, car));
      break;
    case "forward":
      passOn();
      break;
    case "loss":
      editMat(withLoss(useStudio.getState().mat, 0));
      break;
    case null:
  }
  endEdit();
}

function besideOf({ picture }: Session, car: number): [number, number] {
  return picture ? [picture.x[car]! - RANGE_STEP_MM / 100, picture.y[car]!] : [0, 0];
}

/** Let the followers pass all words on: by their first block, and by each block that says otherwise. */
function passOn(): void {
  const workspace = workspaceOf("followers");
  if (!workspace) return;
  Blockly.Events.setGroup(true);
  workspace.getBlocksByType(hatOf("followers"))[0]?.setFieldValue("TRUE", "FORWARD");
  for (const block of workspace.getAllBlocks()) {
    if (block.type !== hatOf("followers") && block.getFieldValue("FORWARD") === "no") block.setFieldValue("same", "FORWARD");
  }
  Blockly.Events.setGroup(false);
}
