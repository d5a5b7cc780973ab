/** What happens once, when the page opens. */

import i18next from "i18next";
import { loadFigures, watchPresence } from "../api/presence";
import { registerClipboard } from "../blocks/clipboard";
import { defineBlocks } from "../blocks/definitions";
import { setBlocklyLanguage } from "../blocks/messages";
import { printWholeBlocks } from "../blocks/printing";
import { openSharedLink } from "../projects/actions";
import { findKept, keepEveryChange } from "../projects/autosave";
import { BLANK } from "../projects/blank";
import { markSaved, markUnsaved, take, watchUnsaved } from "../projects/opening";
import { compileEveryChange } from "../words/compiling";
import { registerHelp } from "./shortcuts";
import { useStudio } from "./store";
import { tell } from "./telling";

let place = "";

async function openFirstProject(): Promise<void> {
  const { key, kept } = await findKept();
  place = key;
  take(kept ?? BLANK, kept?.parkedFollowers ?? null);
  if (!kept?.unsaved) return;
  useStudio.setState({ unsaved: true });
  const time = new Date(kept.at).toLocaleTimeString(i18next.language, { hour: "2-digit", minute: "2-digit" });
  tell(i18next.t("project.restored", { time }));
}

/** The profile's figures and Blockly's words are there: the editors can be drawn. */
export async function prepare(): Promise<void> {
  await Promise.all([loadFigures(), setBlocklyLanguage(i18next.language)]);
  defineBlocks(useStudio.getState().profileFigures!);
  registerClipboard();
  registerHelp();
  printWholeBlocks();
  await openFirstProject();
}

/** The editors stand and hold what was kept. */
export function begin(): void {
  if (useStudio.getState().unsaved) markUnsaved();
  else markSaved();
  watchUnsaved();
  keepEveryChange(place);
  void openSharedLink();
  window.addEventListener("hashchange", () => void openSharedLink());
}

compileEveryChange();
watchPresence(() => tell(i18next.t("server.back"), "success"));
