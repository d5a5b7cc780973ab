/** The studio as static files: Python answers the page in a worker. */

import "../ui/tokens.css";
import { createRoot } from "react-dom/client";
import { folder as pyodideFolder, wheel } from "virtual:pyodide";
import texts from "virtual:texts/studio";
import { connectTo } from "../api/service";
import { startTexts } from "../i18n";
import { startSettings } from "../state/settings";
import { startOffline } from "./offline";
import type { Places } from "./protocol";
import { WorkerService } from "./workerService";

// `motorcade site` writes it: a folder whose name changes with its content.
const folder = document.querySelector<HTMLMetaElement>('meta[name="motorcade-python"]')?.content ?? "";
const pyodide = new URL(pyodideFolder, document.baseURI).href;

/** The whole address of a file such as "start/profiles.json". */
const fileUrl = (name: string) => new URL(folder + name, document.baseURI).href;

const PLACES: Places = {
  pyodide,
  msgspec: pyodide + wheel,
  bytecode: `${pyodide}bytecode.zip`,
  python: fileUrl("python.zip"),
  engine: fileUrl("engine.wasm"),
};

const makeWorker = () => new Worker(new URL("./worker.ts", import.meta.url), { type: "module" });
startSettings();
// Fetched beside each other.
const [{ App }, { findsOpening, start }] = await Promise.all([import("../app/App"), import("../app/start"), startTexts(texts)]);
start();
connectTo(new WorkerService(makeWorker, PLACES, fileUrl, findsOpening()));
createRoot(document.getElementById("root")!).render(<App />);
startOffline().catch((error: unknown) => console.info("The site isn't stored for use without a network:", error));
