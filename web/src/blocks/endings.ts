/**
 * What ends a step that takes time: its seconds, a condition, or whichever comes first. A small field behind the seconds
 * says which; it shows the gap for the condition, or hides the seconds. Parts of a together have no such field: the
 * together has it, and where only its condition ends it, they show no seconds.
 */

import * as Blockly from "blockly/core";
import { say } from "../i18n";

export const ENDS = "ENDS";
export const UNTIL = "UNTIL";
/** The inputs with the seconds, and with this field; and the one behind which the condition has a line of its own. */
export const TIME = "TIME";
export const ENDS_ROW = "ENDS_ROW";
export const BREAK = "BREAK";
export const CONDITION_CHECK = "Boolean";
/** What no block is, so that nothing snaps to a hidden gap. */
const NOTHING_CHECK = "Nothing";

const TOGETHER = "motorcade_together";
const TELL = "motorcade_tell";
const WAYS = ["time", "until", "both"] as const;
type Way = (typeof WAYS)[number];

interface EndsConfig extends Blockly.FieldDropdownConfig {
  ways?: readonly Way[];
}

export class EndsField extends Blockly.FieldDropdown {
  static readonly KIND = "field_motorcade_ends";

  constructor({ ways = WAYS, ...config }: EndsConfig) {
    super(ways.map((way): [string, string] => [say(`blocks.endsMenu.${way}`), way]), undefined, config);
  }

  static override fromJson(options: EndsConfig & Blockly.FieldConfig): EndsField {
    return new this(options);
  }

  /** A block whose time ends it is saved as it was before there were conditions. */
  override isSerializable(): boolean {
    return this.getValue() !== "time";
  }

  protected override getText_(): string {
    return say(`blocks.ends.${this.getValue() as Way}`);
  }
}

/** The inputs of the field, for a block of these types. */
export function endsInputs(type: string): Record<string, unknown>[] {
  // A wait for a condition alone is a block of its own.
  const ways = type === "motorcade_wait" ? ["time", "both"] : WAYS;
  return [
    { type: "input_end_row", name: BREAK },
    { type: EndsField.KIND, name: ENDS, ways },
    { type: "input_dummy", name: ENDS_ROW },
    { type: "input_value", name: UNTIL, check: CONDITION_CHECK },
  ];
}

const isPart = (block: Blockly.Block | null | undefined) => block?.type === TOGETHER || block?.type === TELL;

function show(block: Blockly.Block, name: string, shown: boolean): boolean {
  const input = block.getInput(name);
  if (!input || input.isVisible() === shown) return false;
  input.setVisible(shown);
  return true;
}

/** Show what the block needs for a way to end. `offered`: the field may be used here. */
function shape(block: Blockly.Block, way: Way, offered: boolean): void {
  const around = block.getSurroundParent();
  const inside = isPart(around);
  const timeless = around?.type === TOGETHER && (accompanies(block) || around.getFieldValue(ENDS) === "until");
  const asks = way !== "time" && !inside;
  const gap = block.getInput(UNTIL)!;
  if (way === "time") gap.connection?.targetBlock()?.dispose();
  gap.setCheck(asks ? CONDITION_CHECK : NOTHING_CHECK);
  const changed = [
    show(block, TIME, way !== "until" && !timeless),
    show(block, ENDS_ROW, !inside && (asks || offered)),
    show(block, BREAK, asks),
    show(block, UNTIL, asks),
  ];
  if (changed.includes(true) && block instanceof Blockly.BlockSvg) void block.queueRender();
}

/** Steps that last as long as those beside them; for such a step a together is around it, it shows no seconds. */
const ACCOMPANYING = new Set<string>();
const accompanies = (block: Blockly.Block) => ACCOMPANYING.has(block.type);

/** Make a new block follow its field. */
export function followEnds(block: Blockly.Block, accompanying: boolean): void {
  if (accompanying) ACCOMPANYING.add(block.type);
  shape(block, "time", false);
  block.getField(ENDS)!.setValidator((way: Way) => {
    shape(block, way, block.getInput(ENDS_ROW)!.isVisible());
    return way;
  });
}

/** The field is offered on the block that is selected, or whose field has the focus: others are as narrow as without it. */
export function isSelected({ id }: Blockly.Block): boolean {
  const focused = Blockly.getFocusManager().getFocusedNode();
  const block = focused instanceof Blockly.Field ? focused.getSourceBlock() : Blockly.common.getSelected();
  return block?.id === id;
}

/** Fit a block to where it is. */
function fitBlock(block: Blockly.Block, offered: boolean): void {
  if (!block.getField(ENDS)) return;
  const inside = isPart(block.getSurroundParent());
  // A part of others has no condition of its own.
  if (inside && block.getInputTargetBlock(UNTIL)) block.setFieldValue("time", ENDS);
  shape(block, block.getFieldValue(ENDS) as Way, offered);
}

/** Fit a block and those inside it. */
export function fitEnds(first: Blockly.Block, offered: (block: Blockly.Block) => boolean): void {
  for (const block of first.getDescendants(false)) fitBlock(block, offered(block));
}

/** Fit each block that comes, moves, is selected or left, or changes how it ends. */
export function fitEveryBlock(workspace: Blockly.WorkspaceSvg, offered: (block: Blockly.Block) => boolean): void {
  // Who walks into a block's fields with the keyboard selects nothing until another block is selected.
  let last: string | undefined;
  workspace.addChangeListener((event) => {
    if (event instanceof Blockly.Events.Selected) {
      for (const id of new Set([event.oldElementId, event.newElementId, last])) {
        const selected = id ? workspace.getBlockById(id) : null;
        if (selected) fitBlock(selected, offered(selected));
      }
      last = event.newElementId ?? last;
      return;
    }
    const isChange = event instanceof Blockly.Events.BlockChange && event.name === ENDS;
    if (!isChange && !(event instanceof Blockly.Events.BlockCreate) && !(event instanceof Blockly.Events.BlockMove)) return;
    const block = workspace.getBlockById(event.blockId!);
    if (block) fitEnds(block, offered);
  });
}
