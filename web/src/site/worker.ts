/** The worker of the site: Python answers the page's requests and streams. */

import type { FromWorker, Places, ToWorker } from "./protocol";
import { type Sent, type Shell, startPython } from "./python";

/** What is used of a worker's global scope; the page's own types don't have it. */
interface Scope {
  onmessage: ((event: MessageEvent<ToWorker>) => void) | null;
  postMessage: (message: FromWorker, transfer?: Transferable[]) => void;
}
const scope = globalThis as unknown as Scope;

let shell: Shell | null = null;
/** What came before Python was ready. */
const waiting: ToWorker[] = [];
const timers = new Map<number, ReturnType<typeof setTimeout>>();

scope.onmessage = ({ data: message }) => {
  if (message.is === "start") void start(message.places);
  else if (message.is === "ping") scope.postMessage({ is: "pong" });
  else if (shell) handle(shell, message);
  else waiting.push(message);
};

async function start(places: Places): Promise<void> {
  try {
    shell = await startPython(places);
  } catch (error) {
    scope.postMessage({ is: "failed", reason: String(error) });
    return;
  }
  scope.postMessage({ is: "ready" });
  for (const message of waiting.splice(0)) handle(shell, message);
}

function handle(python: Shell, message: ToWorker): void {
  try {
    if (message.is === "ask") scope.postMessage({ is: "answer", id: message.id, answer: python.answer(message.name, message.message) });
    else if (message.is === "open") {
      scope.postMessage({ is: "opened", stream: message.stream });
      send(message.stream, python.open(message.stream, message.name, message.session));
      wait(python, message.stream);
    } else if (message.is === "data") {
      send(message.stream, python.receive(message.stream, message.data));
      wait(python, message.stream);
    } else if (message.is === "close") {
      clearTimeout(timers.get(message.stream));
      timers.delete(message.stream);
      python.close(message.stream);
    }
  } catch (error) {
    // The shell answers every error of Motorcade's: only Python itself, when it has ended, comes here.
    scope.postMessage({ is: "dead", reason: String(error) });
  }
}

function send(stream: number, sent: Sent): void {
  const messages = sent.toJs();
  sent.destroy();
  for (const data of messages) {
    if (typeof data === "string") scope.postMessage({ is: "data", stream, data });
    else scope.postMessage({ is: "data", stream, data: data.buffer }, [data.buffer]);
  }
}

/** Call Python again when a stream has something to do. */
function wait(python: Shell, stream: number): void {
  clearTimeout(timers.get(stream));
  timers.delete(stream);
  const seconds = python.wait_s(stream);
  if (seconds >= 0) timers.set(stream, setTimeout(() => advance(python, stream), seconds * 1000));
}

function advance(python: Shell, stream: number): void {
  try {
    send(stream, python.advance(stream));
    wait(python, stream);
  } catch (error) {
    scope.postMessage({ is: "dead", reason: String(error) });
  }
}
