/** A whole project in the fragment of a link: nothing of it ever reaches a server. */

import { base64Of, bytesOf } from "../ui/files";

const MARK = "#project=";
/** The most bytes that a link may unpack to: anyone can send one, and a few bytes can unpack to gigabytes. */
export const MOST_BYTES = 500_000;
/** The most characters of a link: a longer one is refused before anything of it is read. */
const MOST_CHARACTERS = 200_000;

/** The fragment that holds a project file and its name. */
export async function fragmentOf(name: string, text: string): Promise<string> {
  const packed = new Blob([JSON.stringify({ name, text })]).stream().pipeThrough(new CompressionStream("deflate-raw"));
  const plain = base64Of(new Uint8Array(await new Response(packed).arrayBuffer()));
  return MARK + plain.replaceAll("+", "-").replaceAll("/", "_").replace(/=+$/, "");
}

/** The project in a fragment; null where there is none. Throws where it is damaged. */
export async function projectIn(fragment: string): Promise<{ name: string; text: string } | null> {
  if (!fragment.startsWith(MARK)) return null;
  if (fragment.length > MOST_CHARACTERS) throw new RangeError(`more than ${MOST_CHARACTERS} characters`);
  const packed = new Blob([bytesOf(fragment.slice(MARK.length).replaceAll("-", "+").replaceAll("_", "/"))]).stream();
  let size = 0;
  const limit = new TransformStream<Uint8Array, Uint8Array>({
    transform(part, out) {
      size += part.length;
      if (size > MOST_BYTES) throw new RangeError(`more than ${MOST_BYTES} bytes`);
      out.enqueue(part);
    },
  });
  const bytes = await new Response(packed.pipeThrough(new DecompressionStream("deflate-raw")).pipeThrough(limit)).arrayBuffer();
  const { name, text } = JSON.parse(new TextDecoder("utf-8", { fatal: true }).decode(bytes)) as Record<string, unknown>;
  if (typeof name !== "string" || typeof text !== "string") throw new TypeError("not a project");
  return { name, text };
}
