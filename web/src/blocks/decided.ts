/** What a leader decides, in its blocks while it runs: the branch that it took, and which conditions are met now. */

import type { Block } from "blockly/core";
import type { CompiledWord, EditorName } from "../api/types";
import type { Decided } from "../generated/messages";
import { shownDecisions, useMat } from "../mat/store";
import { useStudio } from "../state/studio";
import { askedBy } from "../words/deciding";
import { conditionOf } from "./asked";
import { markBlocks } from "./marks";
import { workspaceOf } from "./workspaces";

const BRANCHES = ["motorcade_if", "motorcade_if_else"];

/** The blocks of the branch of an 'if' that another block is in; none where it is in no branch of it. */
function branchWith(asks: Block, inside: Block | null): Block[] {
  let first = inside;
  while (first && first.getParent() !== asks) first = first.getParent();
  const blocks: Block[] = [];
  for (let block = first === asks.getNextBlock() ? null : first; block; block = block.getNextBlock()) blocks.push(block);
  return blocks;
}

/** The 'if's on the way to the present state, each with the branch that was taken. */
function takenBlocks({ path }: Decided, words: readonly CompiledWord[]): string[] {
  const workspace = workspaceOf("leader");
  const blocks = path.map((index) => (workspace && words[index]?.block ? workspace.getBlockById(words[index].block) : null));
  return blocks.flatMap((block, at) => {
    if (!block || !BRANCHES.includes(block.type)) return [];
    return [block, ...branchWith(block, blocks[at + 1] ?? null)].map(({ id }) => id);
  });
}

/** The blocks of the conditions that are met now. */
function metBlocks({ holds }: Decided, words: readonly CompiledWord[]): string[] {
  return holds.flatMap((index) => {
    const word = words[index];
    const asked = word && askedBy(word);
    return (asked && word.block && conditionOf("leader", word.block, asked)) ?? [];
  });
}

const inLeader = (ids: readonly string[]) => new Map<EditorName, readonly string[]>([["leader", ids]]);

/** Mark the blocks with each answer; returns what ends this. */
export function watchDecisions(): () => void {
  return useMat.subscribe((now, before) => {
    if (now.decisions === before.decisions && now.chosen === before.chosen) return;
    const words = useStudio.getState().compiled?.words ?? [];
    const decided = shownDecisions(now);
    markBlocks("motorcade-taken", inLeader(decided ? takenBlocks(decided, words) : []));
    markBlocks("motorcade-met", inLeader(decided ? metBlocks(decided, words) : []));
  });
}
