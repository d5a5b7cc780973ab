// Draws what the page says about a world, without a browser: it runs the page's own sources in Node.
//
// It reads one JSON object a line from stdin. {answer}: a message of the service, as text; {bytes}: a picture, as
// base64; {level}, {range_mm}: settings; {choose}: a car. {ask: language}: write one line to stdout: what the page says
// now; of the timeline, the lane of the chosen car.

import { createInterface } from "node:readline";
import { dirname, join } from "node:path";
import { fileURLToPath, pathToFileURL } from "node:url";

const web = join(dirname(fileURLToPath(import.meta.url)), "../../web");
const from = (path) => import(pathToFileURL(join(web, "node_modules", path)).href);
const { JSDOM } = await from("jsdom/lib/api.js").then((module) => module.default ?? module);
const { window } = new JSDOM("<main></main>", { url: "http://localhost/", pretendToBeVisual: true });
for (const name of ["window", "document", "localStorage", "sessionStorage", "HTMLElement", "Element", "Node", "CSS", "Event"]) {
  globalThis[name] ??= name === "window" ? window : window[name];
}
for (const name of ["localStorage", "sessionStorage"]) {
  Object.defineProperty(globalThis, name, { value: window[name], configurable: true });
}
globalThis.matchMedia = (media) => Object.assign(new EventTarget(), { media, matches: false });
window.matchMedia = globalThis.matchMedia;

const { createServer } = await from("vite/dist/node/index.js");
const vite = await createServer({
  root: web,
  logLevel: "error",
  appType: "custom",
  cacheDir: join(web, "node_modules/.vite-account"),
  server: { middlewareMode: true, hmr: false, ws: false, watch: null },
  optimizeDeps: { noDiscovery: true },
});
const load = (path) => vite.ssrLoadModule(`/src/${path}`);
const { changeLanguage, startTexts } = await load("i18n/index.ts");
await startTexts((await vite.ssrLoadModule("virtual:texts/studio")).default);
const { connectTo } = await load("api/service.ts");
const { session } = await load("mat/session.ts");
const { useMat } = await load("mat/store.ts");
const { useStudio } = await load("state/studio.ts");
const { useSettings } = await load("state/settings.ts");
const { Narration } = await load("mat/Narration.tsx");
const { Thoughts } = await load("mat/Thoughts.tsx");
const { packLane, Mark } = await load("timeline/events.ts");
const { createElement, Fragment } = (await from("react/index.js")).default;
const { createRoot } = (await from("react-dom/client.js")).default;
const { flushSync } = (await from("react-dom/index.js")).default;

let stream = null;
connectTo({
  ask: () => Promise.reject(new Error("nobody answers")),
  openStream: (_name, _session, listeners) => {
    stream = listeners;
    return { send: () => true, close: () => undefined };
  },
});
session.open();
stream.onOpen();
const host = document.querySelector("main");
const root = createRoot(host);
flushSync(() => root.render(createElement(Fragment, null, createElement(Narration), createElement(Thoughts))));

/** What the timeline shows of a car: the word at a moment, and in which milliseconds it has marks. */
function laneOf(car, tMs, nowMs) {
  // A power of two: a pixel is a millisecond without rounding.
  const endMs = 2 ** Math.ceil(Math.log2(nowMs + 2));
  const { spans, marks } = packLane(session.events.of(car), { beginMs: 0, endMs }, nowMs, endMs);
  const span = spans.find(({ beginMs, endMs }) => beginMs < tMs && tMs <= endMs);
  const at = (mark) => {
    const found = [];
    for (let ms = 0; ms < endMs; ms++) if (marks[ms] & mark) found.push(ms);
    return found;
  };
  return { word: span?.word ?? null, frame: at(Mark.frame), heard: at(Mark.heard), lost: at(Mark.lost) };
}

async function told({ ask }) {
  await changeLanguage(ask);
  await new Promise((done) => setTimeout(done));
  // Another language is drawn, then told, then drawn: each only in a turn of its own.
  for (let turn = 0; turn < 5; turn++) {
    await new Promise((done) => setImmediate(done));
    flushSync(() => undefined);
  }
  const { chosen, state, tMs, past, details } = useMat.getState();
  const [caption, announced] = ["p[data-text]", "p[aria-live]"].map((name) => host.querySelector(name));
  return {
    caption: caption?.getAttribute("data-text") ?? "",
    announced: announced?.textContent ?? "",
    thoughts: [...host.querySelectorAll("[data-car]")].map((each) => [Number(each.dataset.car), each.textContent]),
    lane: laneOf(chosen.car, tMs, state.t_ms),
    details,
    tMs,
    past,
  };
}

for await (const line of createInterface({ input: process.stdin })) {
  const order = JSON.parse(line);
  if (order.answer) flushSync(() => stream.onMessage(order.answer));
  if (order.bytes) flushSync(() => stream.onMessage(Uint8Array.from(Buffer.from(order.bytes, "base64")).buffer));
  if (order.level) flushSync(() => useSettings.setState({ level: order.level }));
  if ("choose" in order) useMat.setState({ chosen: { car: order.choose }, details: null });
  if ("range_mm" in order) useStudio.setState({ rangeMm: order.range_mm });
  if (order.ask) process.stdout.write(`${JSON.stringify(await told(order))}\n`);
}
process.exit(0);
