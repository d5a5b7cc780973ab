/** The messages between the page and its workers. */

import type { StreamName } from "../api/service";

/** The addresses of what a worker loads; that of Pyodide's folder ends with a slash. */
export interface Places {
  pyodide: string;
  msgspec: string;
  bytecode: string;
  python: string;
  engine: string;
}

/** From the page; `message` is JSON. */
export type ToWorker =
  | { is: "start"; places: Places }
  | { is: "ping" }
  | { is: "ask"; id: number; name: string; message: string }
  | { is: "open"; stream: number; name: StreamName; session: string }
  | { is: "data"; stream: number; data: string | Uint8Array<ArrayBuffer> }
  | { is: "close"; stream: number };

/** From the worker; `answer` is JSON. `failed`: Python can't start; `dead`: it has ended. */
export type FromWorker =
  | { is: "ready" }
  | { is: "pong" }
  | { is: "answer"; id: number; answer: string }
  | { is: "opened"; stream: number }
  | { is: "data"; stream: number; data: string | ArrayBuffer }
  | { is: "failed" | "dead"; reason: string };

/** To the service worker: the new build shall take over, unless another page has work. */
export type ToServiceWorker = "take-over";
/** Of the service worker: a question, answered with true or false by the port that comes with it; why the new build doesn't take over. */
export type FromServiceWorker = "is-idle" | "others-have-work";
