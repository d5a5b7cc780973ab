import { expect, test } from "vitest";
import { textOf, UnreadableFileError } from "./fileText";

const TEXT = '{"name": "头车 🚗"}';

function utf16(text: string, isLittle: boolean): Uint8Array<ArrayBuffer> {
  const bytes = new DataView(new ArrayBuffer(2 * text.length));
  [...Array(text.length).keys()].forEach((at) => bytes.setUint16(2 * at, text.charCodeAt(at), isLittle));
  return new Uint8Array(bytes.buffer);
}

test.each([
  ["UTF-8", new TextEncoder().encode(TEXT)],
  ["UTF-8 with a mark", new TextEncoder().encode(`\ufeff${TEXT}`)],
  ["UTF-16 of PowerShell", utf16(`\ufeff${TEXT}`, true)],
  ["UTF-16, the other way round", utf16(`\ufeff${TEXT}`, false)],
])("a file in %s is read", async (_, bytes) => {
  expect(await textOf(new Blob([bytes]))).toBe(TEXT);
});

test("a file that is too large is refused unread, and one that can not be read is told apart", async () => {
  const film = Object.defineProperty(new Blob(), "size", { value: 3 * 2 ** 30 });
  await expect(textOf(film)).rejects.toEqual(new UnreadableFileError("tooLarge"));
  const gone = Object.assign(new Blob(["{}"]), { arrayBuffer: () => Promise.reject(new DOMException("gone", "NotReadableError")) });
  await expect(textOf(gone)).rejects.toEqual(new UnreadableFileError("unreadable"));
});
