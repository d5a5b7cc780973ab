/** What a first visit finds: its project, and what the page asks about it, without Python. */

import type { Answer, Command } from "../api/world";
import type { Requests } from "../generated/messages";
import { unpack } from "./archive";
import { type Engine, openEngine } from "./engine";
import { type Recipe, SteppedWorld } from "./steppedWorld";

type Hello = Answer & { is: "hello" };
type State = Answer & { is: "state" };

/** opening.json, as `src/motorcade/browser/opening.py` writes it. */
interface Document extends Recipe {
  project: Requests["opening"]["answer"];
  blocks: Requests["compile"]["message"];
  compiled: Requests["compile"]["answer"];
  set: Command & { do: "set" };
  answers: [Hello, State];
}

export class Opening {
  private constructor(
    private readonly document: Document,
    private readonly memory: Uint8Array,
    private readonly engine: Engine,
  ) {}

  static async load(fileUrl: (name: string) => string): Promise<Opening> {
    const [files, engine] = await Promise.all([unpack(fileUrl("start/opening.zip")), openEngine(fileUrl("engine.wasm"))]);
    const found = Object.fromEntries(files);
    return new Opening(JSON.parse(new TextDecoder().decode(found["opening.json"])) as Document, found.memory!, engine);
  }

  get project(): Document["project"] {
    return this.document.project;
  }

  /** The answer to a request `compile`; null where it is about other blocks. */
  compiled(blocks: Document["blocks"]): Document["compiled"] | null {
    return same(blocks, this.document.blocks) ? this.document.compiled : null;
  }

  /** A world at its beginning, and the answers to its page; null where the page wants another world. */
  world(set: Document["set"], session: string): { world: SteppedWorld; hello: Hello; state: State } | null {
    if (!same(set, this.document.set)) return null;
    const [hello, state] = this.document.answers;
    const world = new SteppedWorld(this.engine.instance(), this.document, this.memory, hello.tick_ms!, hello.cars);
    return { world, hello: { ...hello, session }, state };
  }
}

/** What Blockly adds to blocks, which changes no program. */
const ADDED = ["x", "y", "deletable"];

/** Whether two documents say the same, whatever Blockly adds to blocks. */
function same(a: unknown, b: unknown): boolean {
  return plain(a) === plain(b);
}

function plain(value: unknown): string {
  if (Array.isArray(value)) return `[${value.map(plain).join()}]`;
  if (typeof value !== "object" || value === null) return String(value).toUpperCase();
  const parts = Object.entries(value)
    .filter(([name]) => !ADDED.includes(name))
    .map(([name, each]) => [name, plain(each)])
    .filter(([, text]) => text !== "{}" && text !== "NULL");
  return `{${parts.map((part) => part.join(":")).sort().join()}}`;
}
