import { beforeEach, describe, expect, it, vi } from "vitest";
import { connectTo } from "../api/service";
import type { Blocks, CompiledBlocks } from "../generated/messages";
import { useStudio } from "../state/studio";
import { areWordsDue, compileEveryChange } from "./compiling";

const ANSWER: CompiledBlocks = {
  diagnostics: [],
  image: null,
  dwell_ms: 0,
  tagged: false,
  states: 0,
  follower_words: 0,
  most: 255,
  costliest: { leader: null, followers: null },
  words: [],
  left_out: [],
  counters: [],
};

const asked: { blocks: Blocks; answer: (words: Partial<CompiledBlocks>) => void }[] = [];
connectTo({
  ask: (_, message) => new Promise((resolve) => asked.push({ blocks: message as Blocks, answer: (own) => resolve({ ...ANSWER, ...own }) })),
  openStream: vi.fn(),
});

compileEveryChange();

/** Open a project as a file holds it; the editors then give ids to its blocks. */
function openProject(name: string): void {
  useStudio.setState(({ generation }) => ({ generation: generation + 1, compiled: null, leader: { blocks: `${name} without ids` } }));
  queueMicrotask(() => useStudio.setState({ leader: { blocks: `${name} with ids` } }));
}

const askedFor = () => asked.map(({ blocks }) => blocks.leader.blocks);

describe("the compiler's answers", () => {
  beforeEach(() => {
    asked.length = 0;
  });

  it("are those of blocks with ids, which diagnostics lead to", async () => {
    openProject("first");
    await vi.waitFor(() => expect(askedFor()).toEqual(["first with ids"]));
    asked[0]!.answer({ states: 1 });
    await vi.waitFor(() => expect(useStudio.getState().compiled?.states).toBe(1));
    expect(asked).toHaveLength(1);
  });

  it("are not shown once another project is open", async () => {
    openProject("second");
    await vi.waitFor(() => expect(askedFor()).toEqual(["second with ids"]));
    openProject("third");
    await Promise.resolve();
    asked[0]!.answer({ states: 2 });
    await vi.waitFor(() => expect(askedFor()).toEqual(["second with ids", "third with ids"]));
    expect(useStudio.getState().compiled).toBeNull();
    asked[1]!.answer({ states: 3 });
    await vi.waitFor(() => expect(useStudio.getState().compiled?.states).toBe(3));
  });

  it("are asked for in the turn of the edit, before the page is drawn again", async () => {
    openProject("fourth");
    await vi.waitFor(() => expect(askedFor()).toEqual(["fourth with ids"]));
    asked[0]!.answer({ states: 4 });
    await vi.waitFor(() => expect(useStudio.getState().compiled?.states).toBe(4));
    useStudio.setState({ leader: { blocks: "edited" } });
    expect(askedFor()).toEqual(["fourth with ids", "edited"]);
    asked[1]!.answer({ states: 5 });
    await vi.waitFor(() => expect(useStudio.getState().compiled?.states).toBe(5));
  });

  it("come before other work, but don't hold it up for long", async () => {
    const now = vi.spyOn(performance, "now").mockReturnValue(1000);
    useStudio.setState({ leader: { blocks: "edited again" } });
    expect(areWordsDue()).toBe(true);
    now.mockReturnValue(1060);
    expect(areWordsDue()).toBe(false);
    now.mockReturnValue(1000);
    asked[0]!.answer({ states: 6 });
    await vi.waitFor(() => expect(useStudio.getState().compiled?.states).toBe(6));
    await vi.waitFor(() => expect(areWordsDue()).toBe(false));
    now.mockRestore();
  });
});
