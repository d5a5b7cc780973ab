/**
 * What ends a step that takes time: its seconds, a condition, or whichever comes first. A small field behind the seconds
 * says which; it shows the gap for the condition, or hides the seconds. It also lets a drive mind something. Parts of a
 * together choose no end: the together has it, and where only its condition ends it, they show no seconds.
 */

import * as Blockly from "blockly/core";
import { say } from "../i18n";
import { TurnField } from "./fields";
import { choicesOf, drives, fitUnless, isMinded, type Minded, mindChosen, unlessInputs } from "./minding";

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

/** What a block offers in its small field: whether conditions may end it, what it can mind, and whether the field shows. */
interface Offered {
  asks: boolean;
  minded: readonly Minded[];
  shows: boolean;
}

type OfferedBy = (block: Blockly.Block) => Offered;
let offeredBy: OfferedBy = () => ({ asks: false, minded: [], shows: false });

/** Let blocks offer what their editors do. */
export function offerEnds(offered: OfferedBy): void {
  offeredBy = offered;
}

/** What the small field of a block offers where the block is. Parts of others have no end of their own. */
function choicesAt(block: Blockly.Block, ends: [string, string][]): [string, string][] {
  const { asks, minded } = offeredBy(block);
  const own = asks && !isPart(block.getSurroundParent()) ? ends : [];
  return [...own, ...choicesOf(block, minded)];
}

export class EndsField extends Blockly.FieldDropdown {
  static readonly KIND = "field_motorcade_ends";

  constructor({ ways = WAYS, ...config }: EndsConfig) {
    const ends = ways.map((way): [string, string] => [say(`blocks.endsMenu.${way}`), way]);
    super(function (this: Blockly.FieldDropdown) {
      const block = this.getSourceBlock();
      const choices = block ? choicesAt(block, ends) : [];
      return choices.length ? choices : ends;
    }, undefined, config);
  }

  /** What a block has stays good where its menu doesn't offer it. */
  protected override doClassValidation_(choice?: string): string | null {
    return choice ?? null;
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
    ...(drives(type) ? unlessInputs() : []),
  ];
}

const isPart = (block: Blockly.Block | null | undefined) => block?.type === TOGETHER || block?.type === TELL;

function show(block: Blockly.Block, name: string, shown: boolean): boolean {
  const input = block.getInput(name);
  if (!input || input.isVisible() === shown) return false;
  input.setVisible(shown);
  return true;
}

/** Show what the block needs for a way to end. `offered`: its small field may be used now. */
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
    show(block, ENDS_ROW, asks || offered),
    show(block, BREAK, asks),
    show(block, UNTIL, asks),
    fitUnless(block, show),
  ];
  if (!changed.includes(true) || !(block instanceof Blockly.BlockSvg)) return;
  void block.queueRender();
  // Blockly names a block when it is made and when it gets the focus; in a drawer nothing tells it of what shows since.
  const { State, setState, Verbosity } = Blockly.utils.aria;
  setState(block.getFocusableElement(), State.LABEL, block.getAriaLabel(Verbosity.STANDARD));
}

/** Steps that last as long as those beside them; for such a step a together is around it, it shows no seconds. */
const ACCOMPANYING = new Set<string>();
const accompanies = (block: Blockly.Block) => ACCOMPANYING.has(block.type);

/** Make a new block follow its field. */
export function followEnds(block: Blockly.Block, accompanying: boolean): void {
  if (accompanying) ACCOMPANYING.add(block.type);
  shape(block, "time", false);
  block.getField(ENDS)!.setValidator((way: Way) => {
    if (mindChosen(block, way)) return null;
    shape(block, way, block.getInput(ENDS_ROW)!.isVisible());
    block.getField(TurnField.NAME)?.forceRerender();
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
function fitBlock(block: Blockly.Block): void {
  if (!block.getField(ENDS)) return;
  const inside = isPart(block.getSurroundParent());
  // A part of others has no condition of its own.
  if (inside && block.getInputTargetBlock(UNTIL)) block.setFieldValue("time", ENDS);
  const offered = offeredBy(block).shows && choicesAt(block, [["", "time"]]).length > 0;
  shape(block, block.getFieldValue(ENDS) as Way, offered);
}

/** Fit a block and those inside it. */
export function fitEnds(first: Blockly.Block): void {
  for (const block of first.getDescendants(false)) fitBlock(block);
}

/** Fit all blocks of a workspace, as after they were loaded. */
export function fitAll(workspace: Blockly.Workspace): void {
  for (const top of workspace.getTopBlocks(false)) fitEnds(top);
}

/** Fit each block that comes, moves, is selected or left, changes how it ends, or gets or loses something inside. */
export function fitEveryBlock(workspace: Blockly.WorkspaceSvg): void {
  // Who walks into a block's fields with the keyboard selects nothing until another block is selected.
  let last: string | undefined;
  workspace.addChangeListener((event) => {
    if (event instanceof Blockly.Events.Selected) {
      for (const id of new Set([event.oldElementId, event.newElementId, last])) {
        const selected = id ? workspace.getBlockById(id) : null;
        if (selected) fitBlock(selected);
      }
      last = event.newElementId ?? last;
      return;
    }
    if (event instanceof Blockly.Events.BlockDelete && isMinded(event.oldJson?.type ?? "")) {
      fitAll(workspace);
      return;
    }
    const isChange = event instanceof Blockly.Events.BlockChange && [ENDS, "DIRECTION"].includes(event.name ?? "");
    const isMove = event instanceof Blockly.Events.BlockMove;
    if (!isChange && !isMove && !(event instanceof Blockly.Events.BlockCreate)) return;
    const block = workspace.getBlockById(event.blockId!);
    if (block) fitEnds(block);
    for (const id of isMove ? [event.oldParentId, event.newParentId] : []) {
      let around: Blockly.Block | null = id ? workspace.getBlockById(id) : null;
      while (around?.outputConnection) around = around.getParent();
      if (around) fitBlock(around);
    }
  });
}
