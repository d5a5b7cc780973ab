import { expect, test } from "vitest";
import { textOf } from "./fileText";

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
