/** Which blocks run now, told from what the cars execute. */

import { type CompiledWord, type EditorName, EDITORS } from "../api/types";
import { Flag, NO_INDEX, type Picture } from "../api/world";

export type Running = ReadonlyMap<EditorName, readonly string[]>;

export function runningBlocks(picture: Picture, words: readonly CompiledWord[]): Running {
  const executed = new Uint8Array(words.length);
  for (let k = 0; k < picture.cars; k++) {
    const index = picture.index[k]!;
    if (index !== NO_INDEX && picture.flags[k]! & Flag.runs) executed[index] = 1;
  }
  const running = new Map<EditorName, Set<string>>(EDITORS.map((editor) => [editor, new Set()]));
  words.forEach(({ part, block, fields_of }, place) => {
    if (!executed[place] || part === "header") return;
    const blocks = running.get(part)!;
    if (block !== null) blocks.add(block);
    for (const each of Object.values(fields_of ?? {})) blocks.add(each);
  });
  return new Map(EDITORS.map((editor) => [editor, [...running.get(editor)!].sort()]));
}

export function sameRunning(a: Running, b: Running): boolean {
  return EDITORS.every((editor) => (a.get(editor) ?? []).join() === (b.get(editor) ?? []).join());
}
