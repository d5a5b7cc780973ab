// The page's side of a first visit, without a browser: the page's own FirstWorld runs in Node, by a clock of the test.
//
// It reads one JSON object a line from stdin: {begin}: a new visit, with the path of its opening.zip; {send}: a message of
// the page, as text; {advance_ms}: time passes; {open}: Python is ready; {lose}: it is lost; {texts, pictures}: what
// Python sends, pictures as base64. After each it writes a line: what the page got (texts as they are, pictures as base64 in a list), and what
// Python got.

import { readFile } from "node:fs/promises";
import { createInterface } from "node:readline";
import { dirname, join } from "node:path";
import { fileURLToPath, pathToFileURL } from "node:url";

const web = join(dirname(fileURLToPath(import.meta.url)), "../../web");
const { createServer } = await import(pathToFileURL(join(web, "node_modules/vite/dist/node/index.js")).href);
const vite = await createServer({
  root: web,
  logLevel: "error",
  appType: "custom",
  cacheDir: join(web, "node_modules/.vite-first-world"),
  server: { middlewareMode: true, hmr: false, ws: false, watch: null },
  optimizeDeps: { noDiscovery: true },
});
const { Opening } = await vite.ssrLoadModule("/src/site/opening.ts");
const { FirstWorld } = await vite.ssrLoadModule("/src/site/firstWorld.ts");

let now = 0;
const timers = new Map();
Object.defineProperty(globalThis, "performance", { value: { now: () => now } });
globalThis.setInterval = (run, each) => {
  const key = Symbol();
  timers.set(key, { run, each, due: now + each });
  return key;
};
globalThis.clearInterval = (key) => timers.delete(key);
globalThis.fetch = async (path) => new Response(await readFile(path));

const [page, python] = [[], []];
let listeners = null;
let world = null;
const got = (data) => page.push(typeof data === "string" ? data : [Buffer.from(data).toString("base64")]);

/** Nothing has happened yet. */
async function begin(zip) {
  now = 0;
  timers.clear();
  const opening = await Opening.load(() => zip);
  world = new FirstWorld(opening, "ab".repeat(16), { onOpen: () => undefined, onMessage: got, onClose: () => undefined }, (given) => {
    listeners = given;
    return { send: (data) => python.push(data) > 0, close: () => undefined };
  }, () => undefined);
}

function advance(milliseconds) {
  for (const end = now + milliseconds; ; ) {
    const next = [...timers.values()].sort((a, b) => a.due - b.due)[0];
    if (!next || next.due > end) {
      now = end;
      return;
    }
    now = next.due;
    next.due += next.each;
    next.run();
  }
}

for await (const line of createInterface({ input: process.stdin })) {
  const { begin: zip, send, advance_ms, open, lose, texts = [], pictures = [] } = JSON.parse(line);
  if (zip) await begin(zip);
  if (send) world.send(send);
  if (advance_ms) advance(advance_ms);
  if (lose) listeners.onClose();
  if (open) listeners.onOpen();
  for (const text of texts) listeners.onMessage(text);
  for (const picture of pictures) listeners.onMessage(new Uint8Array(Buffer.from(picture, "base64")).buffer);
  process.stdout.write(`${JSON.stringify({ page: page.splice(0), python: python.splice(0) })}\n`);
}
await vite.close();
