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

/** The files that the user chooses. */
export function chooseFiles(accept: string, multiple: boolean): Promise<File[]> {
  return new Promise((resolve) => {
    const input = Object.assign(document.createElement("input"), { type: "file", accept, multiple });
    input.addEventListener("change", () => resolve([...(input.files ?? [])]));
    input.addEventListener("cancel", () => resolve([]));
    input.click();
  });
}

/** The file that the user chooses; null for none. */
export const chooseFile = async (accept: string) => (await chooseFiles(accept, false))[0] ?? null;
