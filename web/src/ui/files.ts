/** Files that the user gives to the page and gets from it. */

/** Let the browser store a file. */
export function download(name: string, content: BlobPart, type: string): void {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob([content], { type }));
  link.download = name;
  link.click();
  // The browser takes the content when it starts the download, after this turn.
  setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
}

/** A file's name that every system takes. */
export function fileName(name: string, ending: string): string {
  // eslint-disable-next-line no-control-regex
  const plain = name.replace(/[\\/:*?"<>|\u0000-\u001f]/g, " ").trim().slice(0, 80);
  return `${plain || "motorcade"}${ending}`;
}

const PART_BYTES = 1 << 15;

export function base64Of(bytes: Uint8Array): string {
  let text = "";
  for (let at = 0; at < bytes.length; at += PART_BYTES) text += String.fromCharCode(...bytes.subarray(at, at + PART_BYTES));
  return btoa(text);
}

export const bytesOf = (base64: string): Uint8Array<ArrayBuffer> => Uint8Array.from(atob(base64), (character) => character.charCodeAt(0));

/** The files that the user chooses, of any kind where `accept` is empty: several, or one, or all files of a folder. */
export function chooseFiles(accept: string, wishes: { multiple?: boolean; webkitdirectory?: boolean }): Promise<File[]> {
  return new Promise((resolve) => {
    const input = Object.assign(document.createElement("input"), { type: "file", accept, ...wishes });
    input.addEventListener("change", () => resolve([...(input.files ?? [])]));
    input.addEventListener("cancel", () => resolve([]));
    input.click();
  });
}

/** Whether the browser lets its user choose a folder. */
export const choosesFolders = (): boolean => "webkitdirectory" in HTMLInputElement.prototype;

/** The file that the user chooses; null for none. */
export const chooseFile = async (accept: string) => (await chooseFiles(accept, {}))[0] ?? null;
