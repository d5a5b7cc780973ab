/** What the menus do with the open project: open, save, share and export. */

import { textOf, UnreadableFileError } from "../api/fileText";
import { RefusedError, UnreachableError, request } from "../api/service";
import { pictureOf, pngOf } from "../blocks/picture";
import { liveWorkspaces } from "../blocks/workspaces";
import { inLanguage, say } from "../i18n";
import { closeDialog, notify, openDialog, openNotes } from "../state/dialogs";
import { useStudio } from "../state/studio";
import { session } from "../mat/session";
import { editMat } from "../mat/store";
import { wordsCsv } from "../words/bits";
import { chooseFile, download, fileName } from "../ui/files";
import { BLANK, library, markSaved, markUnsaved, openProject, replaceBy } from "./project";
import { fragmentOf, projectIn } from "./share";

const PROJECT_ENDING = ".motorcade.json";

const tellItIsNeeded = () => notify(say("server.needed"), "warning", undefined, ({ service }) => service !== "ready");

/** Run a task; show the user a notice, and answer undefined, where the server refuses it or is gone, or a file can't be read. */
export async function attempt<Answer>(task: () => Promise<Answer>, tellGone = tellItIsNeeded): Promise<Answer | undefined> {
  try {
    return await task();
  } catch (error) {
    if (error instanceof RefusedError) notify(inLanguage(error.sentence), "error");
    else if (error instanceof UnreachableError) tellGone();
    else if (error instanceof UnreadableFileError) notify(say(`project.${error.reason}`, error.values), "error");
    else throw error;
    return undefined;
  }
}

export function openFile(): Promise<void> {
  return attempt(async () => {
    const file = await chooseFile(".json,.py,application/json,text/x-python");
    if (!file) return;
    const opened = await request("open", { text: await textOf(file) });
    await replaceBy({ ...opened, name: file.name.replace(/(\.motorcade)?\.json$|\.py$/i, "") }, { stored: true });
  });
}

/** Open a project of the library, its newest version or another. Throws RefusedError or UnreachableError. */
export async function openSaved(name: string, version?: number): Promise<void> {
  const project = await request("projects/read", { name, version });
  closeDialog();
  await replaceBy({ ...project, name }, { stored: true });
}

export function startNew(): Promise<unknown> {
  return attempt(() => replaceBy(BLANK));
}

export function saveFile(): Promise<void> {
  return attempt(async () => {
    const project = openProject();
    const sent = useStudio.getState();
    const { text } = await request("save-text", project);
    download(fileName(sent.name, PROJECT_ENDING), text, "application/json");
    markSaved(sent);
    useStudio.setState({ stored: true });
  });
}

/** Save to the library; a project without a name gets one there. */
export async function save(): Promise<void> {
  if (!(await saveToLibrary())) openDialog("library");
}

/** Saves to the library under the project's name; false where it has none yet. */
export async function saveToLibrary(): Promise<boolean> {
  const name = useStudio.getState().name.trim();
  if (!name) return false;
  await attempt(() => library.save());
  return true;
}

export async function shareLink(): Promise<string> {
  const { text } = await request("save-text", openProject());
  const { origin, pathname } = location;
  return origin + pathname + (await fragmentOf(useStudio.getState().name, text));
}

/** Links of a class's pages show the notes of a mission. */
const NOTES = "#notes=";

/** Open the project, or the notes, in the page's own address, and remove them from the address. */
export function openSharedLink(): Promise<void> {
  const { hash, pathname, search } = location;
  if (!hash) return Promise.resolve();
  if (hash.startsWith(NOTES)) {
    history.replaceState(null, "", pathname + search);
    openNotes(decodeURIComponent(hash.slice(NOTES.length)));
    return Promise.resolve();
  }
  return attempt(async () => {
    const played = session.plays;
    const shared = await projectIn(hash).catch(() => notify(say("share.damaged"), "error"));
    if (!shared) return;
    history.replaceState(null, "", pathname + search);
    const opened = await request("open", { text: shared.text });
    // Who has pressed Play meanwhile meant this project.
    const wanted = !played && session.plays;
    if (!(await replaceBy({ ...opened, name: shared.name }))) return;
    if (wanted) session.play();
    setTimeout(markUnsaved);
  });
}

/** Put the mat of a file in place of the project's: one of its own, as for `--mat`, or that of another project. */
export function openMat(): Promise<void> {
  return attempt(async () => {
    const file = await chooseFile(".json,.toml,application/json");
    if (file) editMat(await request("mats/open", { text: await textOf(file), name: file.name }));
  });
}

export function saveMat(): void {
  const { mat } = useStudio.getState();
  download(fileName(mat.name, ".mat.json"), `${JSON.stringify(mat, null, 1)}\n`, "application/json");
}

export function exportCsv(): void {
  const { compiled, name } = useStudio.getState();
  if (!compiled?.image) notify(say("export.noWords"), "warning", undefined, (now) => !now.compiled?.image);
  // Spreadsheets recognize UTF-8 by this byte order mark.
  else download(fileName(name, ".csv"), `\ufeff${wordsCsv(compiled.words)}`, "text/csv;charset=utf-8");
}

export async function exportPicture(kind: "svg" | "png"): Promise<void> {
  for (const [editor, workspace] of liveWorkspaces()) {
    const picture = pictureOf(workspace);
    const name = fileName(`${useStudio.getState().name || "motorcade"} ${editor}`, `.${kind}`);
    if (kind === "svg") download(name, picture.svg, "image/svg+xml");
    else download(name, await pngOf(picture), "image/png");
  }
}
