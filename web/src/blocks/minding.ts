/**
 * What a block that drives minds: its socket 'unless', and the conditions that fit there. The socket shows while something
 * is in it. The small field behind the seconds, or a block of the palette, brings the first condition.
 */

import * as Blockly from "blockly/core";
import { STEP_KINDS } from "../generated/steps";
import { say } from "../i18n";

export const UNLESS = "UNLESS";
const LABEL = "MINDS";
/** The end of the line before, and the line with the text above the socket: beside it, both would be too wide for a phone. */
const BREAK = "UNLESS_BREAK";
const ABOVE = "UNLESS_ABOVE";
/** What conditions are that a drive can mind. */
export const MINDED_CHECK = "Minded";
const ANY = "motorcade_when_any";

type State = Blockly.serialization.blocks.State;

/** By the kind of step with the same bits: the condition in the socket. */
const MINDED = {
  pir: { type: "motorcade_when_person" },
  voice: { type: "motorcade_when_voice", fields: { COMMAND: "stop" } },
  avoid: { type: "motorcade_when_obstacle" },
  floor: { type: "motorcade_when_floor", fields: { WHERE: "either" } },
} satisfies Record<string, State>;
export type Minded = keyof typeof MINDED;
export const MINDED_KINDS = Object.keys(MINDED) as readonly Minded[];
/** What a choice of the small field begins with that fills the socket. */
const CHOICE = "unless ";
const OBSTACLE = MINDED.avoid.type;
const MINDED_TYPES: ReadonlySet<string> = new Set([...Object.values(MINDED).map(({ type }) => type), ANY]);
const DRIVING: ReadonlySet<string> = new Set(STEP_KINDS.filter(({ drives }) => drives).map(({ kind }) => `motorcade_${kind}`));

export const drives = (type: string): boolean => DRIVING.has(type);
export const isMinded = (type: string): boolean => MINDED_TYPES.has(type);

/** The inputs of the socket, on lines of their own. */
export const unlessInputs = (): Record<string, unknown>[] => [
  { type: "input_end_row", name: BREAK },
  { type: "field_label", name: LABEL, text: "" },
  { type: "input_end_row", name: ABOVE },
  { type: "input_value", name: UNLESS, check: MINDED_CHECK },
];

/** A new block of a type that minds something. Only a random drive stands on dark floor. */
export function mindingBlock(type: string, kind: Minded): State {
  const fields = kind === "floor" ? { DIRECTION: "random" } : {};
  return { type, fields, inputs: { [UNLESS]: { block: MINDED[kind] } } };
}

/** The types of conditions in a socket, those inside of 'or' too. */
function mindedIn(block: Blockly.Block | null): string[] {
  if (block?.type !== ANY) return block ? [block.type] : [];
  return block.getChildren(false).flatMap(mindedIn);
}

/** Show the socket where something is in it. Its text says what the car does: an obstacle holds no car, but turns it away. */
export function fitUnless(block: Blockly.Block, show: (block: Blockly.Block, name: string, shown: boolean) => boolean): boolean {
  if (!block.getInput(UNLESS)) return false;
  const types = mindedIn(block.getInputTargetBlock(UNLESS));
  const changed = [BREAK, ABOVE, UNLESS].map((name) => show(block, name, types.length > 0)).includes(true);
  const label = block.getField(LABEL)!;
  const text = types.length ? labelOf(types) : "";
  // A value that is set anew is measured anew.
  if (label.getValue() !== text) label.setValue(text, false);
  return changed;
}

function labelOf(types: readonly string[]): string {
  if (!types.includes(OBSTACLE)) return say("blocks.unless.holds");
  return say(types.every((type) => type === OBSTACLE) ? "blocks.unless.turns" : "blocks.unless.mixed");
}

/** What else a block can mind, of what is offered, as choices of its small field. */
export function choicesOf(block: Blockly.Block, offered: readonly Minded[]): [text: string, value: string][] {
  if (!drives(block.type)) return [];
  const present = mindedIn(block.getInputTargetBlock(UNLESS));
  const isRandom = block.getFieldValue("DIRECTION") === "random";
  const left = offered.filter((kind) => !present.includes(MINDED[kind].type) && (kind !== "floor" || isRandom));
  return left.map((kind) => [say(`blocks.minds.${kind}`), CHOICE + kind]);
}

/** Let a block mind what was chosen in its small field, beside what it minds already; whether that was the choice. */
export function mindChosen(block: Blockly.Block, choice: string): boolean {
  const kind = MINDED_KINDS.find((each) => CHOICE + each === choice);
  if (!kind) return false;
  const socket = block.getInput(UNLESS)!.connection!;
  const present = socket.targetBlock();
  const group = Blockly.Events.getGroup();
  Blockly.Events.setGroup(group || true);
  let state: State = MINDED[kind];
  if (present) {
    state = { type: ANY, inputs: { OF0: { block: Blockly.serialization.blocks.save(present)! }, OF1: { block: state } } };
    present.dispose();
  }
  const made = Blockly.serialization.blocks.append(state, block.workspace, { recordUndo: true });
  socket.connect(made.outputConnection!);
  Blockly.Events.setGroup(group);
  return true;
}
