/** A whole project in the fragment of a link: nothing of it ever reaches a server. */

const MARK = "#project=";
/** The most bytes that a link may unpack to: anyone can send one, and a few bytes can unpack to gigabytes. */
export const MOST_BYTES = 500_000;
/** The most characters of a link: a longer one is refused before anything of it is read. */
const MOST_CHARACTERS = 200_000;

function toBase64Url(bytes: Uint8Array): string {
  let binary = "";
  for (const byte of bytes) binary += String.fromCharCode(byte);
  return btoa(binary).replaceAll("+", "-").replaceAll("/", "_").replace(/=+$/, "");
}

function fromBase64Url(text: string): Uint8Array<ArrayBuffer> {
  const binary = atob(text.replaceAll("-", "+").replaceAll("_", "/"));
  return Uint8Array.from(binary, (character) => character.charCodeAt(0));
}

async function collect(stream: ReadableStream<Uint8Array>, most: number): Promise<Uint8Array> {
  const parts: Uint8Array[] = [];
  let size = 0;
  const reader = stream.getReader();
  for (let next = await reader.read(); !next.done; next = await reader.read()) {
    size += next.value.length;
    if (size > most) {
      await reader.cancel();
      throw new RangeError(`more than ${most} bytes`);
    }
    parts.push(next.value);
  }
  const whole = new Uint8Array(size);
  parts.reduce((at, part) => (whole.set(part, at), at + part.length), 0);
  return whole;
}

/** The fragment that holds a project file and its name. */
export async function fragmentOf(name: string, text: string): Promise<string> {
  const packed = new Blob([JSON.stringify({ name, text })]).stream().pipeThrough(new CompressionStream("deflate-raw"));
  return MARK + toBase64Url(await collect(packed, Infinity));
}

/** The project in a fragment; null where there is none. Throws where it is damaged. */
export async function projectIn(fragment: string): Promise<{ name: string; text: string } | null> {
  if (!fragment.startsWith(MARK)) return null;
  if (fragment.length > MOST_CHARACTERS) throw new RangeError(`more than ${MOST_CHARACTERS} characters`);
  const packed = new Blob([fromBase64Url(fragment.slice(MARK.length))]).stream();
  const bytes = await collect(packed.pipeThrough(new DecompressionStream("deflate-raw")), MOST_BYTES);
  const { name, text } = JSON.parse(new TextDecoder("utf-8", { fatal: true }).decode(bytes)) as Record<string, unknown>;
  if (typeof name !== "string" || typeof text !== "string") throw new TypeError("not a project");
  return { name, text };
}
