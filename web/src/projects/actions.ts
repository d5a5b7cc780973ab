/** What the menus do with the open project. */

import i18next from "i18next";
import * as api from "../api/http";
import { tell } from "../app/telling";
import { useStudio } from "../app/store";
import { liveWorkspaces } from "../blocks/workspaces";
import { inLanguage } from "../i18n";
import { wordsCsv } from "../words/csv";
import { chooseFile, download, fileName } from "./downloads";
import { markSaved, markUnsaved, openProject, replaceBy } from "./opening";
import { fragmentOf, projectIn } from "./share";

const PROJECT_ENDING = ".motorcade.json";

/** Runs what may fail, and tells the user where it does. */
export async function attempt(task: () => Promise<void>): Promise<void> {
  try {
    await task();
  } catch (error) {
    if (error instanceof api.RefusedError) tell(inLanguage(error.sentence), "error");
    else if (error instanceof api.GoneError) tell(i18next.t("server.needed"), "warning");
    else throw error;
  }
}

export function openFile(): Promise<void> {
  return attempt(async () => {
    const file = await chooseFile(".json,application/json");
    if (!file) return;
    const opened = await api.open(await file.text());
    await replaceBy({ ...opened, name: file.name.replace(/(\.motorcade)?\.json$/i, "") });
  });
}

export function saveFile(): Promise<void> {
  return attempt(async () => {
    const { text } = await api.projectText(openProject());
    download(fileName(useStudio.getState().name, PROJECT_ENDING), text, "application/json");
    markSaved();
  });
}

/** Saves to the library under the project's name; false where it has none yet. */
export async function saveToLibrary(): Promise<boolean> {
  const name = useStudio.getState().name.trim();
  if (!name) return false;
  await attempt(async () => {
    const { version } = await api.saveProject(name, openProject());
    markSaved();
    tell(i18next.t("library.saved", { name, version }), "success");
  });
  return true;
}

export async function shareLink(): Promise<string> {
  const { text } = await api.projectText(openProject());
  const { origin, pathname } = location;
  return origin + pathname + (await fragmentOf(useStudio.getState().name, text));
}

/** Opens what the page's own address holds, and takes it off the address. */
export function openSharedLink(): Promise<void> {
  const { hash, pathname, search } = location;
  if (!hash) return Promise.resolve();
  return attempt(async () => {
    const shared = await projectIn(hash).catch(() => tell(i18next.t("share.damaged"), "error"));
    if (!shared) return;
    history.replaceState(null, "", pathname + search);
    const opened = await api.open(shared.text);
    if (await replaceBy({ ...opened, name: shared.name })) setTimeout(markUnsaved);
  });
}

export function exportCsv(): void {
  const { compiled, formats, name } = useStudio.getState();
  if (!compiled?.words.length || !formats) tell(i18next.t("export.noWords"), "warning");
  // Spreadsheets take a file for UTF-8 by its mark.
  else download(fileName(name, ".csv"), `\ufeff${wordsCsv(compiled.words, formats)}`, "text/csv;charset=utf-8");
}

export async function exportPicture(kind: "svg" | "png"): Promise<void> {
  const { pictureOf, pngOf } = await import("../blocks/picture");
  for (const [editor, workspace] of liveWorkspaces()) {
    const picture = pictureOf(workspace);
    const name = fileName(`${useStudio.getState().name || "motorcade"} ${editor}`, `.${kind}`);
    if (kind === "svg") download(name, picture.svg, "image/svg+xml");
    else download(name, await pngOf(picture), "image/png");
  }
}
