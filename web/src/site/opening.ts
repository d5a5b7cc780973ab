/** What a first visit finds: its project, what the page asks about it, and its first seconds, recorded; without Python. */

import type { Answer, Command } from "../api/world";
import type { Requests } from "../generated/messages";
import { bytesOf } from "../ui/files";
import { unpack } from "./archive";

/** opening.json, as `scripts/opening_recording.py` writes it. */
interface Document {
  project: Requests["opening"]["answer"];
  blocks: Requests["compile"]["message"];
  compiled: Requests["compile"]["answer"];
  set: Command & { do: "set" };
  hello: Answer & { is: "hello" };
  /** All that the world sends: answers, and pictures as base64. */
  messages: (string | Answer)[];
}

/** A recorded world: what its page gets, in order. */
export interface Recording {
  hello: Answer & { is: "hello" };
  messages: readonly (ArrayBuffer | Answer)[];
}

export class Opening {
  private constructor(private readonly document: Document) {}

  static async load(fileUrl: (name: string) => string): Promise<Opening> {
    const [[, data]] = (await unpack(fileUrl("start/opening.zip"))) as [[string, Uint8Array]];
    return new Opening(JSON.parse(new TextDecoder().decode(data)) as Document);
  }

  get project(): Document["project"] {
    return this.document.project;
  }

  /** The answer to a request `compile`; null where it is about other blocks. */
  compiled(blocks: Document["blocks"]): Document["compiled"] | null {
    return same(blocks, this.document.blocks) ? this.document.compiled : null;
  }

  /** The recorded world; null where the page wants another one. */
  recording(set: Document["set"], session: string): Recording | null {
    if (!same(set, this.document.set)) return null;
    const { hello, messages } = this.document;
    return { hello: { ...hello, session }, messages: messages.map((each) => (typeof each === "string" ? bytesOf(each).buffer : each)) };
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
    .map(([name, part]) => [name, plain(part)])
    .filter(([, text]) => text !== "{}" && text !== "NULL");
  return `{${parts.map((part) => part.join(":")).sort().join()}}`;
}
