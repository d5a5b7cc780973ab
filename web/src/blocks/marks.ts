/** Marks on blocks: the compiler's diagnostics, which blocks run now, and what was decided. */

import type { BlockSvg } from "blockly/core";
import type { Diagnostic, EditorName } from "../api/types";
import { inLanguage } from "../i18n";
import { useStudio } from "../state/studio";
import { standsAlone } from "./definitions";
import { liveWorkspaces, workspaceOf } from "./workspaces";

const WARNING = "motorcade";
const marked = new Map<EditorName, Map<string, string>>();
/** A branch that was taken; a condition that is met now. */
export type Mark = "motorcade-running" | "motorcade-taken" | "motorcade-met";
/** The marked blocks, by mark and editor. */
const lit = new Map<string, ReadonlySet<string>>();

/** Show each diagnostic on its block; blocks whose sentences didn't change are left alone. */
export function markDiagnostics(diagnostics: readonly Diagnostic[]): void {
  for (const [editor, workspace] of liveWorkspaces()) {
    const texts = new Map<string, string>();
    for (const { block, editor: where, sentence } of diagnostics) {
      if (block === null || where !== editor) continue;
      texts.set(block, [...(texts.has(block) ? [texts.get(block)!] : []), inLanguage(sentence)].join("\n"));
    }
    const before = marked.get(editor) ?? new Map<string, string>();
    const wrong = new Set(diagnostics.filter(({ severity }) => severity === "error").map(({ block }) => block));
    for (const id of before.keys()) if (!texts.has(id)) mark(workspace.getBlockById(id), null, false);
    for (const [id, text] of texts) if (before.get(id) !== text) mark(workspace.getBlockById(id), text, wrong.has(id));
    marked.set(editor, texts);
  }
}

/**
 * Set a class of the block and of its outline. The style sheet selects the outline by its own class: a selector that
 * begins at the block would make the browser restyle all blocks below it, too.
 */
function setClass(block: BlockSvg, name: string, on: boolean): void {
  if (on) block.addClass(name);
  else block.removeClass(name);
  (block.pathObject as { svgPath?: SVGElement }).svgPath?.classList.toggle(name, on);
}

function mark(block: BlockSvg | null, text: string | null, wrong: boolean): void {
  if (!block) return;
  block.setWarningText(text, WARNING);
  setClass(block, "motorcade-wrong", wrong);
}

/** Show which blocks are attached to no hat, and so belong to no program; not while a hand moves one. */
export function markLoose(editor: EditorName): void {
  const workspace = workspaceOf(editor);
  if (workspace?.isDragging()) return;
  const all = useStudio.getState().loose;
  const now = workspace?.getTopBlocks(true).filter(({ type }) => !standsAlone(type)) ?? [];
  for (const { block: id } of all.filter((each) => each.editor === editor)) {
    const block = workspace?.getBlockById(id);
    if (block && !now.includes(block)) setClass(block, "motorcade-loose", false);
  }
  for (const block of now) setClass(block, "motorcade-loose", true);
  if (now.length || all.length) {
    useStudio.setState({ loose: [...all.filter((each) => each.editor !== editor), ...now.map(({ id }) => ({ editor, block: id }))] });
  }
}

/** Forget the marks of an editor that was filled with new blocks. */
export function forgetMarks(editor: EditorName): void {
  marked.delete(editor);
  for (const name of lit.keys()) if (name.endsWith(` ${editor}`)) lit.delete(name);
}

/** Give these blocks of both editors a mark, and take it from all others. */
export function markBlocks(mark: Mark, blocks: ReadonlyMap<EditorName, readonly string[]>): void {
  for (const [editor, workspace] of liveWorkspaces()) {
    const now = new Set(blocks.get(editor));
    const before = lit.get(`${mark} ${editor}`) ?? new Set<string>();
    for (const id of new Set([...before, ...now])) {
      const block = before.has(id) === now.has(id) ? null : workspace.getBlockById(id);
      if (block) setClass(block, mark, now.has(id));
    }
    lit.set(`${mark} ${editor}`, now);
  }
}
