/** Blockly's workspaces, one for each editor: create, fill, read and search them. */

import * as Blockly from "blockly/core";
import { EDITORS, type EditorName, type WorkspaceState } from "../api/types";
import { say } from "../i18n";
import { notify } from "../state/dialogs";
import { useSettings } from "../state/settings";
import { useStudio } from "../state/studio";
import { hatOf, mindedBy, offersConditions, stepsFor, toolboxOf } from "./definitions";
import { DRAWER_PLUGINS } from "./drawers";
import { fitAll, fitEveryBlock, isSelected, offerEnds } from "./endings";
import { followNames } from "./names";
import { themeOf } from "./themes";

const live = new Map<EditorName, Blockly.WorkspaceSvg>();

export function workspaceOf(editor: EditorName): Blockly.WorkspaceSvg | undefined {
  return live.get(editor);
}

export function editorOf(workspace: Blockly.Workspace | null): EditorName | undefined {
  return EDITORS.find((editor) => live.get(editor) === workspace);
}

export function liveWorkspaces(): [EditorName, Blockly.WorkspaceSvg][] {
  return [...live];
}

/** What a mission lets the user do with blocks: which kinds it offers (null: all), and whether only their bits change them. */
let offer: { steps: readonly string[] | null; locked: boolean } = { steps: null, locked: false };

/** Offer the blocks of a mission in all editors, also in those that are created later. */
export function offerBlocks(steps: readonly string[] | null, locked: boolean): void {
  offer = { steps, locked };
  offerAgain();
  for (const workspace of live.values()) {
    lock(workspace);
    fitAll(workspace);
  }
}

/** Fill all toolboxes anew. */
function offerAgain(): void {
  for (const [editor, workspace] of live) workspace.updateToolbox(toolboxOf(editor, offer.steps, staged));
}

/** The kinds of steps for what stands on the stage, which the first level offers with its own. */
let staged: readonly string[] = stepsFor(useStudio.getState().mat);

/** Offer blocks for what somebody puts on the stage. To be called once. */
export function followStage(): void {
  useStudio.subscribe(({ mat }, before) => {
    if (mat === before.mat) return;
    const now = stepsFor(mat);
    if (now.join() === staged.join()) return;
    staged = now;
    offerAgain();
  });
}

// Only a leader's steps end by a condition; a follower minds what a leader does.
offerEnds((block) => ({
  asks: editorOf(block.workspace) === "leader" && offersConditions(offer.steps),
  minded: mindedBy(offer.steps),
  shows: isSelected(block),
}));

/** The editors whose blocks somebody else makes, which this page only shows. */
let foreign: ReadonlySet<EditorName> = new Set();

/** Show the blocks of these editors without letting the user change them. */
export function lockEditors(editors: ReadonlySet<EditorName>): void {
  foreign = editors;
  for (const workspace of live.values()) lock(workspace);
}

/** Blocks that are changed by their bits alone, or by somebody else, can't be dragged, and their menus stay closed. */
function lock(workspace: Blockly.WorkspaceSvg): void {
  const locked = offer.locked || foreign.has(editorOf(workspace)!);
  if (workspace.isReadOnly() === locked) return;
  workspace.setIsReadOnly(locked);
  (workspace.getToolbox() as Blockly.Toolbox | null)?.setVisible(!locked);
}

/** The followers' editor with nothing but its hat. They pass words on unless the user turns that off: else cars far away stand. */
export const EMPTY_FOLLOWERS: WorkspaceState = {
  blocks: { languageVersion: 0, blocks: [{ type: hatOf("followers"), id: hatOf("followers"), x: 24, y: 24, fields: { FORWARD: true } }] },
};

export function createWorkspace(host: HTMLElement, editor: EditorName): Blockly.WorkspaceSvg {
  const workspace = Blockly.inject(host, {
    toolbox: toolboxOf(editor, offer.steps, staged),
    theme: themeOf(useSettings.getState().theme),
    renderer: "zelos",
    plugins: DRAWER_PLUGINS,
    media: `${import.meta.env.BASE_URL}assets/blockly/`,
    sounds: false,
    trashcan: true,
    modalInputs: false,
    maxInstances: { [hatOf(editor)]: 1 },
    move: { scrollbars: true, drag: true, wheel: true },
    zoom: { controls: true, pinch: true, wheel: false, startScale: 1, minScale: 0.3, maxScale: 2 },
  });
  quickenStyles();
  letSoundRest();
  workspace.getSvgGroup().setAttribute("aria-label", say(`editors.${editor}Blocks`));
  host.addEventListener("focusin", () => beginUnderHat(editor, workspace));
  live.set(editor, workspace);
  lock(workspace);
  fitEveryBlock(workspace);
  workspace.addChangeListener((event) => {
    const isDrop = event instanceof Blockly.Events.BlockDrag && !event.isStart;
    const block = isDrop && workspace.getBlockById(event.blockId!);
    if (!block) return;
    keepFocus(block);
    void scrollTo(block);
  });
  followNames(workspace);
  return workspace;
}

/**
 * Blockly draws the place where a block may snap in one picture later, and for that moves what stands there in the document.
 * A block that was dropped there before that picture loses the focus by it, and with it the small field of its ends.
 */
function keepFocus(block: Blockly.BlockSvg): void {
  if (document.activeElement === document.body) Blockly.getFocusManager().focusNode(block);
}

/** Scroll to all of a block that was dropped: its fields are wanted next, and the blocks of a phone are low. */
async function scrollTo(block: Blockly.BlockSvg): Promise<void> {
  await Blockly.renderManagement.finishQueuedRenders();
  if (!block.isDisposed()) block.workspace.scrollBoundsIntoView(block.getBoundingRectangleWithoutChildren());
}

const SOUND_RESTS_MS = 1000;
const soundRests = new WeakSet<AudioContext>();

/**
 * Each of Blockly's workspaces, and each drawer is one, has a context for its beeps at keys that do nothing. One that runs
 * costs a tenth of a processor, and all run that are made after a click: each rests until it beeps, and after it.
 */
function letSoundRest(): void {
  for (const workspace of Blockly.Workspace.getAll()) {
    if (!(workspace instanceof Blockly.WorkspaceSvg)) continue;
    const { context } = workspace.getAudioManager() as unknown as { context?: AudioContext };
    if (!context || soundRests.has(context)) continue;
    soundRests.add(context);
    const rest = () => context.state === "running" && void context.suspend();
    context.addEventListener("statechange", () => setTimeout(rest, SOUND_RESTS_MS));
    rest();
  }
}

/**
 * Parts of Blockly's selectors, and what stands in their place: the outline of the place that had the focus last shows
 * also while a field's editor has the focus, and the outline of a selected block is selected by its own class. With the
 * parts, the browser restyles all blocks whenever the focus moves: 30 ms for each edit of a program with 255 blocks.
 */
const QUICKER_SELECTORS = [
  [":not(:has(.blocklyDropDownDiv:focus-within, .blocklyWidgetDiv:focus-within))", ""],
  [".blocklySelected > .blocklyPath.blocklyPathSelected", ".blocklyPathSelected"],
  [".blocklySelected > .blocklyPathLight", ".blocklyPathLight.blocklyPathSelected"],
] as const;

function quickenStyles(): void {
  for (const sheet of document.styleSheets) {
    for (const rule of sheet.cssRules) {
      if (!(rule instanceof CSSStyleRule)) continue;
      const selector = QUICKER_SELECTORS.reduce((text, [slow, quick]) => text.replaceAll(slow, quick), rule.selectorText);
      if (selector !== rule.selectorText) rule.selectorText = selector;
    }
  }
}

/**
 * Blockly puts a block that is fetched from the toolbox by keyboard below the block that had the focus last. Where none
 * had it, choose the program's last block: a block without connection would be no part of the program.
 */
function beginUnderHat(editor: EditorName, workspace: Blockly.WorkspaceSvg): void {
  if (Blockly.FocusableTreeTraverser.findFocusedNode(workspace)) return;
  const hat = workspace.getTopBlocks(false).find(({ type }) => type === hatOf(editor));
  if (!hat) return;
  const last = hat.lastConnectionInStack(false)?.getSourceBlock() ?? hat;
  last.getFocusableElement().classList.add(Blockly.FocusManager.PASSIVE_FOCUS_NODE_CSS_CLASS_NAME);
}

interface Histories {
  /** The number of the project that it belongs to. */
  generation: number;
  undo: object[];
  redo: object[];
}

/** The undo histories of closed editors, for when they are opened again in another language or with the followers. */
const histories = new Map<EditorName, Histories>();

export function disposeWorkspace(editor: EditorName): void {
  const workspace = live.get(editor);
  if (!workspace) return;
  const [undo, redo] = [workspace.getUndoStack(), workspace.getRedoStack()].map((stack) => stack.map((event) => event.toJson()));
  histories.set(editor, { generation: useStudio.getState().generation, undo: undo!, redo: redo! });
  workspace.dispose();
  live.delete(editor);
}

/** Resolves when Blockly has told of new blocks, which it does behind the next picture. */
const told = () => new Promise<void>((resolve) => requestAnimationFrame(() => setTimeout(resolve)));

/** Make many blocks and draw them: each text is measured once, and the workspace when all blocks are there. */
export function drawAtOnce(workspace: Blockly.WorkspaceSvg, make: () => void): void {
  Blockly.utils.dom.startTextWidthCache();
  workspace.setResizesEnabled(false);
  make();
  // A block that is fitted before it is drawn isn't drawn again when its event comes.
  fitAll(workspace);
  Blockly.renderManagement.triggerQueuedRenders(workspace);
  workspace.setResizesEnabled(true);
  // Blocks above and beside the new ones are drawn again in the next picture, and all once more when their events have come.
  const { finishQueuedRenders } = Blockly.renderManagement;
  void finishQueuedRenders().then(told).then(finishQueuedRenders).then(Blockly.utils.dom.stopTextWidthCache);
}

/** Fill the editor; a state without the first block gets one. */
export function fill(editor: EditorName, state: WorkspaceState): void {
  const workspace = live.get(editor)!;
  // Without events: the trash can keeps what a user deleted, not the blocks of the project before.
  Blockly.Events.disable();
  workspace.clear();
  Blockly.Events.enable();
  drawAtOnce(workspace, () => {
    try {
      Blockly.serialization.workspaces.load(state, workspace);
    } catch (error) {
      console.warn("These blocks are damaged:", error);
      notify(say("project.damaged"), "error");
    }
  });
  if (workspace.getBlocksByType(hatOf(editor)).length === 0) {
    Blockly.serialization.blocks.append({ type: hatOf(editor), id: hatOf(editor), x: 24, y: 24 }, workspace);
  }
  measureAgain(workspace);
  workspace.clearUndo();
  restoreHistory(editor, workspace);
  workspace.scroll(0, 0);
}

/** While a style sheet is loaded, WebKit knows no styles, and texts are measured in another font. */
function measureAgain(workspace: Blockly.WorkspaceSvg): void {
  for (const link of document.querySelectorAll<HTMLLinkElement>("link[rel=stylesheet]")) {
    if (link.sheet) continue;
    const measure = () => workspace.getAllBlocks(false).forEach((block) => [...block.getFields()].forEach((field) => field.forceRerender()));
    link.addEventListener("load", measure, { once: true });
  }
}

/** Restore the history of a closed editor: blocks keep their ids, so it still applies. */
function restoreHistory(editor: EditorName, workspace: Blockly.WorkspaceSvg): void {
  const history = histories.get(editor);
  histories.delete(editor);
  if (history?.generation !== useStudio.getState().generation) return;
  const made = (events: object[]) =>
    events.map((event) => Blockly.Events.fromJson(event as ReturnType<Blockly.Events.Abstract["toJson"]>, workspace));
  workspace.getUndoStack().push(...made(history.undo));
  workspace.getRedoStack().push(...made(history.redo));
}

export function read(editor: EditorName): WorkspaceState {
  return Blockly.serialization.workspaces.save(live.get(editor)!);
}

/** Focus the leader's first block, below which the next one is put. */
export function focusBlocks(): void {
  showBlock("leader", workspaceOf("leader")?.getBlocksByType(hatOf("leader"))[0]?.id ?? "");
}

/** The editor that has this block: the given one, or the other. The leader's has the steps that it tells its followers. */
export function editorWith(editor: EditorName, id: string): EditorName {
  const has = (each: EditorName) => Boolean(live.get(each)?.getBlockById(id));
  return has(editor) ? editor : (EDITORS.find(has) ?? editor);
}

/** Bring the block into view, select it, and give it the keyboard's focus. */
export function showBlock(where: EditorName, id: string): void {
  const editor = editorWith(where, id);
  const block = live.get(editor)?.getBlockById(id);
  if (!block) return;
  useStudio.setState({ editor });
  block.workspace.scrollBoundsIntoView(block.getBoundingRectangleWithoutChildren());
  block.select();
  Blockly.getFocusManager().focusNode(block);
}

/** Give the workspaces each new theme. To be called once. */
export function startThemes(): void {
  Blockly.Scrollbar.scrollbarThickness = Blockly.Touch.TOUCH_ENABLED ? 12 : 8;
  useSettings.subscribe((settings, before) => {
    if (settings.theme === before.theme) return;
    for (const workspace of live.values()) workspace.setTheme(themeOf(settings.theme));
  });
}

/** The text of the block with this id, without that of the blocks inside it; empty where it is gone. */
export function findText(editor: EditorName, id: string): string {
  const inputs = workspaceOf(editor)?.getBlockById(id)?.inputList ?? [];
  const fields = inputs.flatMap((input) => (input.isVisible() ? input.fieldRow : []));
  return fields.map((field) => field.getText()).join(" ").replace(/\s+/g, " ").trim();
}
