/** Names that pupils choose, for counters and for their own blocks: a text, and below it the names that are there already. */

import * as Blockly from "blockly/core";
import { say } from "../i18n";

const DEFINE = "motorcade_define";
const LONGEST = 40;
let lists = 0;

/** A name that Python takes too; null where nothing is left of the text. */
export function nameOf(typed: string): string | null {
  const text = typed.normalize("NFKC").trim().replace(/\s+/g, "_");
  const name = text.replace(/[^\p{L}\p{N}_]/gu, "").replace(/^\p{N}+/u, "");
  return name.slice(0, LONGEST) || null;
}

/** The program's workspace, also for a block in a drawer. */
const programOf = (workspace: Blockly.Workspace | undefined) =>
  workspace instanceof Blockly.WorkspaceSvg && workspace.isFlyout ? workspace.targetWorkspace : workspace;

type NameConfig = Blockly.FieldTextInputConfig & { text?: string };

export class NameField extends Blockly.FieldTextInput {
  static readonly KIND = "field_motorcade_name";

  static override fromJson(options: NameConfig): NameField {
    return new this(options.text ?? "", undefined, options);
  }

  /** The names that fields of this name have in the program. */
  private known(): string[] {
    const blocks = programOf(this.getSourceBlock()?.workspace)?.getAllBlocks(true) ?? [];
    const fields = blocks.map((block) => block.getField(this.name!)).filter((field) => field instanceof NameField && field !== this);
    return [...new Set(fields.map((field) => String(field!.getValue())))];
  }

  /** A block out of a drawer has the first name that is there already; one that defines has a new one. */
  override initModel(): void {
    super.initModel();
    const block = this.getSourceBlock();
    if (!block?.isInFlyout) return;
    const known = this.known();
    const first = String(this.getValue());
    let name = first;
    if (block.type !== DEFINE) name = known[0] ?? first;
    else for (let number = 2; known.includes(name); number++) name = `${first}${number}`;
    this.setValue(name);
  }

  protected override doClassValidation_(typed?: unknown): string | null {
    return typeof typed === "string" ? nameOf(typed) : null;
  }

  protected override widgetCreate_(): HTMLInputElement {
    const input = super.widgetCreate_() as HTMLInputElement;
    const list = document.createElement("datalist");
    list.id = `names-${++lists}`;
    list.append(...this.known().map((name) => new Option(name, name)));
    input.after(list);
    input.setAttribute("list", list.id);
    return input;
  }
}

/** Where a block that defines gets another name, those that do it get it too. */
export function followNames(workspace: Blockly.Workspace): void {
  workspace.addChangeListener((event) => {
    if (!(event instanceof Blockly.Events.BlockChange) || event.name !== "NAME" || !event.recordUndo) return;
    if (workspace.getBlockById(event.blockId!)?.type !== DEFINE) return;
    const before = String(event.oldValue);
    if (workspace.getBlocksByType(DEFINE).some((block) => block.getFieldValue("NAME") === before)) return;
    Blockly.Events.setGroup(event.group || true);
    for (const block of workspace.getBlocksByType("motorcade_do")) {
      if (block.getFieldValue("NAME") === before) block.setFieldValue(event.newValue, "NAME");
    }
    Blockly.Events.setGroup(false);
  });
}

/** What a counter, or a block of one's own, is called at first. */
export const counterField = () => ({ type: NameField.KIND, name: "COUNTER", text: say("blocks.firstCounter") });
export const ownBlockField = () => ({ type: NameField.KIND, name: "NAME", text: say("blocks.firstOwnBlock") });
