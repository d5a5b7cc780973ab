/** The word table for a spreadsheet. */

import type { CompiledWord, Field, Formats } from "../api/types";

const cell = (value: string | number) => {
  const text = String(value);
  return /[",\n\r]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text;
};

/** A line for each word: its index, part, bytes, bits, and every field of both formats. */
export function wordsCsv(words: readonly CompiledWord[], formats: Formats): string {
  const names = (fields: Field[]) => fields.map((field) => field.name);
  const header = names(formats.header).filter((name) => name !== "reserved");
  const fields = [...header, ...names(formats.control)];
  const lines = words.map((word, index) => [
    index,
    word.part,
    `0x${word.hex.toUpperCase()}`,
    parseInt(word.hex, 16).toString(2).padStart(32, "0"),
    ...fields.map((name) => word.values[name] ?? ""),
  ]);
  return [["index", "part", "hex", "bits", ...fields], ...lines].map((line) => line.map(cell).join(",") + "\r\n").join("");
}
