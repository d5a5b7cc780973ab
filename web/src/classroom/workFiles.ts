/** Files with pupils' work that the teacher chooses or drops: which of them are checked, and what of them is sent. */

import { MOST_BYTES, MOST_FILES } from "../generated/classroom";
import { base64Of } from "../ui/files";

/** A file and its path below what was chosen. */
export interface Found {
  path: string;
  file: File;
}

/** A file as a report takes it; `data` is base64. */
export interface WorkFile {
  name: string;
  data: string;
}

/** No program is as long: of a longer file, maybe a film, its name is enough. */
const LONGEST_BYTES = 1 << 20;
/** As the command `motorcade check` does: neither hidden files nor reports. */
const isWork = (path: string) => !/(^|\/)\.|-report\.(html|csv)$/.test(path);

export const chosenFiles = (files: readonly File[]): Found[] => files.map((file) => ({ path: file.webkitRelativePath || file.name, file }));

/** What was dropped, with all that its folders hold, but no more than can be checked. To be called in the event's turn. */
export async function droppedFiles({ items, files }: DataTransfer): Promise<Found[]> {
  const entries = [...items].map((item) => item.webkitGetAsEntry()).filter((entry) => entry !== null);
  if (entries.length === 0) return chosenFiles([...files]);
  const found: Found[] = [];
  const visit = async (entry: FileSystemEntry): Promise<void> => {
    const path = entry.fullPath.slice(1);
    if (!isWork(path) || found.length > MOST_FILES) return;
    if (entry.isFile) {
      const file = await new Promise<File>((resolve, reject) => (entry as FileSystemFileEntry).file(resolve, reject)).catch(() => null);
      found.push({ path, file: file ?? unreadable(path) });
      return;
    }
    for (const each of await entriesOf(entry as FileSystemDirectoryEntry)) await visit(each);
  };
  for (const entry of entries) await visit(entry);
  return found;
}

/** Stands for a file that is gone: reading it fails. */
function unreadable(path: string): File {
  const file = new File([], path);
  file.arrayBuffer = () => Promise.reject(new Error(path));
  return file;
}

/** A browser gives some at a time, and none at the end or where the folder can't be read. */
async function entriesOf(folder: FileSystemDirectoryEntry): Promise<FileSystemEntry[]> {
  const reader = folder.createReader();
  const found: FileSystemEntry[] = [];
  for (;;) {
    const some = await new Promise<FileSystemEntry[]>((resolve) => reader.readEntries(resolve, () => resolve([])));
    if (some.length === 0 || found.length > MOST_FILES) return found;
    found.push(...some);
  }
}

/** Why files can't be checked: the key of a text; null where they can. */
export function refusal(found: readonly Found[]): "checkNothing" | "checkTooMany" | "checkTooLarge" | null {
  const work = workOf(found);
  if (work.length === 0) return "checkNothing";
  if (work.length > MOST_FILES) return "checkTooMany";
  return work.reduce((sum, { file }) => sum + sentBytes(file), 0) > MOST_BYTES ? "checkTooLarge" : null;
}

const sentBytes = ({ size }: File) => (size > LONGEST_BYTES ? 0 : size);

/** Those that are checked, by path below the folder that holds all of them. */
export function workOf(found: readonly Found[]): Found[] {
  const root = `${found[0]?.path.split("/", 1)[0]}/`;
  const start = found.every(({ path }) => path.startsWith(root)) ? root.length : 0;
  return found.map(({ path, file }) => ({ path: path.slice(start), file })).filter(({ path }) => isWork(path));
}

/** The bytes of a file, none of one that is too long to be sent; null where it can't be read. */
async function dataOf(file: File): Promise<string | null> {
  if (sentBytes(file) !== file.size) return "";
  try {
    return base64Of(new Uint8Array(await file.arrayBuffer()));
  } catch {
    return null;
  }
}

/** Read what is checked; `unread` could not be read. */
export async function readWork(found: readonly Found[]): Promise<{ files: WorkFile[]; unread: string[] }> {
  const read = await Promise.all(
    workOf(found).map(async ({ path, file }) => ({ name: path, data: await dataOf(file) })),
  );
  return {
    files: read.filter((each): each is WorkFile => each.data !== null),
    unread: read.filter(({ data }) => data === null).map(({ name }) => name),
  };
}
