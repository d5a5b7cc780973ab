/** Read a ZIP archive: the files of Python's packages. */

const END = 0x06054b50;
const ENTRY = 0x02014b50;
const DEFLATED = 8;
const END_BYTES = 22;

/** Fetch and unpack an archive. Throws where it is missing or damaged. */
export async function unpack(url: string): Promise<[path: string, data: Uint8Array][]> {
  const response = await fetch(url);
  if (!response.ok) throw new Error(`${url}: ${response.status}`);
  return await Promise.all(entries(await response.arrayBuffer(), url));
}

function* entries(archive: ArrayBuffer, name: string): Generator<Promise<[string, Uint8Array]>> {
  const view = new DataView(archive);
  let end = archive.byteLength - END_BYTES;
  while (end >= 0 && view.getUint32(end, true) !== END) end--;
  if (end < 0) throw new Error(`${name} is damaged`);
  let at = view.getUint32(end + 16, true);
  for (let left = view.getUint16(end + 10, true); left > 0; left--) {
    if (view.getUint32(at, true) !== ENTRY) throw new Error(`${name} is damaged`);
    const [nameBytes, extra, comment] = [28, 30, 32].map((offset) => view.getUint16(at + offset, true)) as [number, number, number];
    const path = new TextDecoder().decode(new Uint8Array(archive, at + 46, nameBytes));
    const local = view.getUint32(at + 42, true);
    const start = local + 30 + view.getUint16(local + 26, true) + view.getUint16(local + 28, true);
    const bytes = new Uint8Array(archive, start, view.getUint32(at + 20, true));
    if (!path.endsWith("/")) yield inflate(bytes, view.getUint16(at + 10, true)).then((data) => [path, data]);
    at += 46 + nameBytes + extra + comment;
  }
}

async function inflate(bytes: Uint8Array<ArrayBuffer>, method: number): Promise<Uint8Array> {
  if (method !== DEFLATED) return bytes;
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate-raw"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}
