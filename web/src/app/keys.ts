/** The page's own keys, wherever the focus is. */

import { save } from "../projects/actions";
import { endEdit, redo, undo } from "../state/history";
import { useDialogs } from "../state/dialogs";
import { toggleChase } from "../mat/store";
import { showAlone, toggleSound, useStudio } from "../state/studio";

/** With Control or Command. */
const COMMANDS: Record<string, () => void> = { s: () => void save(), z: undo, y: redo, Z: redo };

/** Alone, and only where the key isn't text and means nothing to the blocks. */
const SINGLE: Record<string, () => void> = {
  f: () => showAlone(useStudio.getState().alone ? null : "full"),
  c: toggleChase,
  m: toggleSound,
  b: () => showAlone(useStudio.getState().alone === "projector" ? null : "projector"),
};

const isText = (target: Element) => target.matches("input, textarea, select, [contenteditable=true]");

function press(event: KeyboardEvent): void {
  if (event.defaultPrevented || event.altKey || !(event.target instanceof Element)) return;
  const { open, question } = useDialogs.getState();
  const command = event.ctrlKey || event.metaKey;
  const action = (command ? COMMANDS : SINGLE)[event.key];
  const saves = command && event.key === "s";
  if (!action || open || question || (isText(event.target) && !saves)) return;
  if (!command && event.target.closest("[data-keys=own]")) return;
  event.preventDefault();
  endEdit();
  action();
}

/** To be called once. */
export function listenForKeys(): void {
  window.addEventListener("keydown", press);
  // Escape ends the full screen by the browser itself.
  document.addEventListener("fullscreenchange", () => document.fullscreenElement ?? useStudio.setState({ alone: null }));
  window.addEventListener("keydown", ({ key }) => key === "Escape" && useStudio.getState().alone && showAlone(null));
}
