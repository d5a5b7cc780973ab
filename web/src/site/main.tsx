/** The studio as static files: Python answers the page in a worker. */

import "../ui/tokens.css";
import { createRoot } from "react-dom/client";
import { connectTo } from "../api/service";
import { App } from "../app/App";
import { findsOpening, start } from "../app/start";
import { fileUrl, PLACES } from "./files";
import { startOffline } from "./offline";
import { WorkerService } from "./workerService";

const makeWorker = () => new Worker(new URL("./worker.ts", import.meta.url), { type: "module" });
start();
connectTo(new WorkerService(makeWorker, PLACES, fileUrl, findsOpening()));
createRoot(document.getElementById("root")!).render(<App />);
startOffline().catch((error: unknown) => console.info("The site isn't stored for use without a network:", error));
