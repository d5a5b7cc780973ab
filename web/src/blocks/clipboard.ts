/** Copy and paste within and between the editors. */

import * as Blockly from "blockly/core";
import type { EditorName } from "../api/types";
import { say } from "../i18n";
import { notify } from "../state/dialogs";
import { own, shareCopied } from "../state/otherTabs";
import { canStandIn, hatOf } from "./definitions";
import { ENDS } from "./endings";
import { editorOf } from "./workspaces";

interface BlockState {
  type: string;
  fields?: Record<string, unknown>;
  inputs?: Record<string, { block?: BlockState }>;
  next?: { block?: BlockState };
}

/** The blocks inside a copied one and the one below it. */
function innerStates(state: BlockState): BlockState[] {
  const below = [...Object.values(state.inputs ?? {}), ...(state.next ? [state.next] : [])];
  return below.flatMap(({ block }) => (block ? [block] : []));
}

/** Every type in a copied stack of blocks. */
export function typesIn(state: BlockState): Set<string> {
  return new Set([state.type, ...innerStates(state).flatMap((inner) => [...typesIn(inner)])]);
}

/** Whether a condition ends one of the blocks. */
function asks(state: BlockState): boolean {
  return state.fields?.[ENDS] !== undefined || innerStates(state).some(asks);
}

/** Why the blocks can't be pasted there, as a key of the page's sentences; null where they can. */
export function refusal(editor: EditorName, state: BlockState): "clipboard.hat" | "clipboard.leaderInfrared" | "clipboard.leaderOnly" | null {
  const foreign = [...typesIn(state)].find((type) => !canStandIn(editor, type));
  if (editor === "followers" && (foreign ? canStandIn("leader", foreign) : asks(state))) return "clipboard.leaderOnly";
  if (foreign === undefined) return null;
  return foreign === hatOf("leader") || foreign === hatOf("followers") ? "clipboard.hat" : "clipboard.leaderInfrared";
}

/** Blockly pastes where it copied from; here a paste goes to the editor that has the focus. */
function paste(focused: Blockly.WorkspaceSvg): boolean {
  const workspace = focused.isFlyout ? focused.targetWorkspace! : focused;
  const editor = editorOf(workspace);
  if (!editor) return false;
  const copied = own.copied as Partial<Blockly.clipboard.BlockCopyData> | null;
  if (!copied) {
    notify(say("clipboard.empty"));
    return true;
  }
  const state = copied.blockState;
  const reason = state ? refusal(editor, state) : null;
  if (reason) {
    notify(say(reason), "warning");
    return true;
  }
  const { left, top, width, height } = workspace.getMetricsManager().getViewMetrics(true);
  const selected = Blockly.getSelected();
  const beside = selected instanceof Blockly.BlockSvg && selected.workspace === workspace;
  const at = beside ? selected.getRelativeToSurfaceXY() : new Blockly.utils.Coordinate(left + width / 4, top + height / 3);
  return Blockly.clipboard.paste(copied as Blockly.ICopyData, workspace, at) !== null;
}

/** What was copied can be pasted in the browser's other tabs too. */
function share(): void {
  const copied = Blockly.clipboard.getLastCopiedData();
  if (copied) shareCopied(copied);
}

type Shortcut = Blockly.ShortcutRegistry.KeyboardShortcut;

/** Change what a key of Blockly's does. */
function alterShortcut(name: string, change: (original: Shortcut) => Partial<Shortcut>): void {
  const registry = Blockly.ShortcutRegistry.registry;
  const original = registry.getRegistry()[name]!;
  // The keys are registered already.
  registry.register({ ...original, keyCodes: [], ...change(original) }, true);
}

function registerShortcuts(): void {
  const { COPY, CUT, PASTE } = Blockly.ShortcutItems.names;
  for (const name of [COPY, CUT]) {
    alterShortcut(name, ({ callback }) => ({
      callback: (...given) => {
        const done = callback!(...given);
        share();
        return done;
      },
    }));
  }
  alterShortcut(PASTE, () => ({
    preconditionFn: (workspace) => !workspace.isReadOnly() && !workspace.isDragging(),
    callback: (workspace, event) => {
      event.preventDefault();
      return paste(workspace);
    },
  }));
}

/** Copy and paste without a keyboard. */
function registerMenuItems(): void {
  const menu = Blockly.ContextMenuRegistry.registry;
  menu.register({
    id: "motorcade-copy",
    weight: 0,
    scopeType: Blockly.ContextMenuRegistry.ScopeType.BLOCK,
    displayText: () => say("clipboard.copy"),
    preconditionFn: ({ block }) => (block?.isCopyable() ? "enabled" : "hidden"),
    callback: ({ block }) => {
      Blockly.clipboard.copy(block!);
      share();
    },
  });
  menu.register({
    id: "motorcade-paste",
    weight: 0,
    scopeType: Blockly.ContextMenuRegistry.ScopeType.WORKSPACE,
    displayText: () => say("clipboard.paste"),
    preconditionFn: () => "enabled",
    callback: ({ workspace }) => void paste(workspace!),
  });
}

/** To be called once. */
export function registerClipboard(): void {
  registerShortcuts();
  registerMenuItems();
  Blockly.ContextMenuItems.registerCommentOptions();
}
