/** All files of Motorcade are smaller; a film would use up the memory of the page. */
const MOST_MB = 32;

/** A file that the page can't read: it is too large, or it is gone, locked or on a stick that was pulled. */
export class UnreadableFileError extends Error {
  constructor(
    readonly reason: "tooLarge" | "unreadable",
    readonly values = { most: MOST_MB },
  ) {
    super(reason);
  }
}

/** Return the text of a file: UTF-8, or UTF-16 with its mark, as PowerShell's `>` writes. Throws UnreadableFileError. */
export async function textOf(file: Blob): Promise<string> {
  if (file.size > MOST_MB << 20) throw new UnreadableFileError("tooLarge");
  const content = await file.arrayBuffer().catch(() => null);
  if (!content) throw new UnreadableFileError("unreadable");
  const bytes = new Uint8Array(content);
  const [first, second] = bytes;
  let encoding = "utf-8";
  if (first === 0xff && second === 0xfe) encoding = "utf-16le";
  if (first === 0xfe && second === 0xff) encoding = "utf-16be";
  return new TextDecoder(encoding).decode(bytes);
}
