/** What happens once, when the page opens. */

import * as Blockly from "blockly/core";
import { registerClipboard } from "../blocks/clipboard";
import { defineBlocks, setBlocklyLanguage } from "../blocks/definitions";
import { startPrinting } from "../blocks/picture";
import { followStage, startThemes } from "../blocks/workspaces";
import { registerBlockStops } from "../certainty/stops";
import { languageNow, say } from "../i18n";
import { toggleChase } from "../mat/store";
import { request } from "../api/service";
import { takeOwnWorld } from "../api/worldConnection";
import { reload } from "../ui/panes";
import { openSharedLink, save } from "../projects/actions";
import { attemptInClass, findPupilsWork, lookAt, looking, startPupil } from "../pupil/store";
import { autosave, leftOpening } from "../projects/autosave";
import { BLANK, markSaved, markUnsaved, library, loadProject } from "../projects/project";
import { watchOtherWindows } from "../projects/windows";
import { resumeMission, watchMissions } from "../missions/store";
import { notify, openDialog, useDialogs } from "../state/dialogs";
import { useQuestion } from "../state/questions";
import { endEdit, redo, undo } from "../state/history";
import { own, startOtherTabs } from "../state/otherTabs";
import { useSettings } from "../state/settings";
import { showTour } from "../state/tour";
import { loadFigures, showAlone, toggleSound, useStudio } from "../state/studio";
import { compileEveryChange } from "../words/compiling";

/** Blockly's own undo covers one editor; the page's covers everything. */
function registerKeys(): void {
  const registry = Blockly.ShortcutRegistry.registry;
  for (const own of ["undo", "redo"]) registry.unregister(own);
  for (const own of ["undoWorkspace", "redoWorkspace"]) Blockly.ContextMenuRegistry.registry.unregister(own);
  registry.register({
    name: "list_shortcuts",
    keyCodes: [Blockly.utils.KeyCodes.SLASH],
    callback: () => {
      openDialog("help");
      return true;
    },
  });
}

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
  const { open } = useDialogs.getState();
  const { question } = useQuestion.getState();
  const command = event.ctrlKey || event.metaKey;
  const action = (command ? COMMANDS : SINGLE)[event.key];
  const saves = command && event.key === "s";
  if (!action || open || question || (isText(event.target) && !saves)) return;
  if (!command && event.target.closest("[data-keys=own]")) return;
  event.preventDefault();
  endEdit();
  action();
}

/** Act on the page's own keys, wherever the focus is. */
function listenForKeys(): void {
  window.addEventListener("keydown", press);
  // Escape ends the full screen by the browser itself.
  document.addEventListener("fullscreenchange", () => document.fullscreenElement ?? useStudio.setState({ alone: null }));
  window.addEventListener("keydown", ({ key }) => key === "Escape" && useStudio.getState().alone && showAlone(null));
}

/** Before anything is drawn: what watches the stores. */
export function start(): void {
  startOtherTabs();
  startThemes();
  followStage();
  compileEveryChange();
  listenForKeys();
  watchMissions();
  // Nothing that a user does fails without a word, not even by a mistake of ours.
  window.addEventListener("unhandledrejection", () => notify(say("app.unexpected"), "error", { label: say("app.reload"), run: reload }));
  useStudio.subscribe((now, before) => {
    if (now.service !== "ready") return;
    if (before.service === "gone") notify(say("server.back"), "success");
    if (before.service === "restarting") notify(say("server.restarted"), "success");
  });
}

/** A copy of a pupil's project, which has no place in this browser; false where this is no such tab. */
async function openPupilsProject(): Promise<boolean> {
  const wanted = looking();
  if (!wanted) return false;
  loadProject(BLANK);
  await attemptInClass(async () => loadProject(await lookAt(wanted)));
  return true;
}

/** Whether this page may find what a first visit finds: not for those who have gone on from it, or come by a link. */
export const findsOpening = (): boolean => (!useSettings.getState().toured || leftOpening()) && !location.hash;

/** Open what a first visit finds, whose cars drive at once; false where it isn't for this page. */
async function openOpening(): Promise<boolean> {
  if (!findsOpening()) return false;
  const project = await request("opening").catch(() => null);
  if (!project) return false;
  loadProject(project);
  useStudio.setState({ isOpening: true });
  showTour();
  return true;
}

async function openFirstProject(): Promise<void> {
  await takeOwnWorld();
  if (await openPupilsProject()) return;
  const isPupil = useStudio.getState().capabilities?.classroom === "pupil";
  const stored = isPupil ? await findPupilsWork() : await autosave.find();
  if ((stored?.isOpening ?? true) && !isPupil && (await openOpening())) return;
  loadProject(stored ?? BLANK, stored?.parkedFollowers ?? null);
  useStudio.setState({ stored: stored?.stored ?? false, kept: stored?.kept ?? null, attempts: stored?.attempts ?? {} });
  void resumeMission();
  if (!stored?.unsaved) return;
  useStudio.setState({ unsaved: true });
  const time = new Date(stored.at).toLocaleTimeString(languageNow(), { hour: "2-digit", minute: "2-digit" });
  notify(say("project.restored", { time }));
}

let prepared = false;

/** Load what the editors need to be made: Blockly's messages, and the blocks of the profile. */
export function prepareEditors(): void {
  setBlocklyLanguage();
  if (prepared) return;
  prepared = true;
  defineBlocks(useStudio.getState().profileFigures!);
  useStudio.subscribe(({ profileFigures }, before) => {
    if (profileFigures && profileFigures !== before.profileFigures) defineBlocks(profileFigures);
  });
  registerClipboard();
  registerBlockStops();
  registerKeys();
  startPrinting();
}

/** Open the first project. The editors can be made then, but of what a first visit finds, whose cars come first. */
export async function prepare(): Promise<void> {
  await loadFigures();
  if (!findsOpening()) prepareEditors();
  await openFirstProject();
  if (!useStudio.getState().isOpening) prepareEditors();
}

/** The editors exist and hold the project: from now on, changes are stored and links are opened. */
export function openEditors(): void {
  if (useStudio.getState().unsaved) markUnsaved();
  else markSaved();
  library.watch();
  if (own.place) autosave.start();
  watchOtherWindows();
  if (useStudio.getState().capabilities?.classroom === "pupil") startPupil();
  void openSharedLink();
  window.addEventListener("hashchange", () => void openSharedLink());
}
