/** The worker of the site: Python answers the page's requests and streams. */

import type { FromWorker, Places, ToWorker } from "./protocol";
import { type Sent, type Shell, startPython } from "./python";
import { openStore, StoredRequests } from "./store";

/** What is used of a worker's global scope; the page's own types don't have it. */
interface Scope {
  onmessage: ((event: MessageEvent<ToWorker>) => void) | null;
  postMessage: (message: FromWorker, transfer?: Transferable[]) => void;
}
const scope = globalThis as unknown as Scope;

/** The requests that use the store of projects. */
const STORED = /^(projects\/|mission)/;

let shell: Shell | null = null;
let stored: StoredRequests;
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
    const [python, store] = await Promise.all([startPython(places), openStore()]);
    shell = python;
    stored = new StoredRequests(store, python.storage);
  } catch (error) {
    scope.postMessage({ is: "failed", reason: String(error) });
    return;
  }
  scope.postMessage({ is: "ready" });
  for (const message of waiting.splice(0)) handle(shell, message);
}

function handle(python: Shell, message: ToWorker): void {
  try {
    if (message.is === "ask") ask(python, message);
    else if (message.is === "open") {
      // The virtual car begins with the image that another tab may have uploaded.
      if (message.name === "upload") stored.answer(() => open(python, message), () => undefined).catch(dead);
      else open(python, message);
    } else if (message.is === "data") {
      send(message.stream, python.receive(message.stream, message.data));
      wait(python, message.stream);
    } else if (message.is === "close") {
      clearTimeout(timers.get(message.stream));
      timers.delete(message.stream);
      python.close(message.stream);
    }
  } catch (error) {
    dead(error);
  }
}

/** The shell answers every error of Motorcade's: only Python itself, when it has ended, comes here. */
function dead(error: unknown): void {
  scope.postMessage({ is: "dead", reason: String(error) });
}

function ask(python: Shell, { id, name, message }: ToWorker & { is: "ask" }): void {
  const reply = (answer: string) => scope.postMessage({ is: "answer", id, answer });
  if (STORED.test(name)) stored.answer(() => python.answer(name, message), (why) => python.refuse(why)).then(reply, dead);
  else reply(python.answer(name, message));
}

function open(python: Shell, { stream, name, session }: ToWorker & { is: "open" }): void {
  scope.postMessage({ is: "opened", stream });
  send(stream, python.open(stream, name, session));
  wait(python, stream);
}

function send(stream: number, sent: Sent): void {
  const messages = sent.toJs();
  sent.destroy();
  void stored.keepCar();
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
    dead(error);
  }
}
