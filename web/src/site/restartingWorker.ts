/** A worker in which Python runs; one that ends or hangs is started again, and asked again what it had not answered. */

import { type Stream, type StreamListeners, type StreamName, UnreachableError } from "../api/service";
import type { FromWorker, Places, ToWorker } from "./protocol";

const PING_MS = 2000;
/** Python is started so often in a row; a request is sent so often. */
const MOST_STARTS = 3;
const MOST_TRIES = 2;

type WorkerState = "starting" | "ready" | "restarting" | "failed";

interface Pending {
  message: ToWorker;
  tries: number;
  resolve: (answer: string) => void;
  reject: (error: Error) => void;
}

export class RestartingWorker {
  private worker: Worker;
  private isReady = false;
  private unanswered = 0;
  private failures = 0;
  private last = 0;
  private readonly pending = new Map<number, Pending>();
  private readonly streams = new Map<number, { listeners: StreamListeners; isOpen: boolean }>();

  /**
   * @param makeWorker makes a worker that runs `worker.ts`.
   * @param places the addresses of what it loads.
   * @param mostUnanswered a worker that leaves so many pings unanswered, one each two seconds, hangs.
   * @param onState called when the worker's state changes.
   * @param due Python starts when it is resolved; what is sent before waits in the worker.
   */
  constructor(
    private readonly makeWorker: () => Worker,
    private readonly places: Places,
    private readonly mostUnanswered: number,
    private readonly onState: (state: WorkerState) => void,
    private readonly due: Promise<void>,
  ) {
    this.worker = this.start();
    setInterval(() => this.ping(), PING_MS);
  }

  /** Send a request; both texts are JSON. */
  ask(name: string, message: string): Promise<string> {
    return new Promise((resolve, reject) => {
      if (this.failures >= MOST_STARTS) {
        reject(new UnreachableError());
        return;
      }
      const id = ++this.last;
      const ask: ToWorker = { is: "ask", id, name, message };
      this.pending.set(id, { message: ask, tries: 1, resolve, reject });
      this.post(ask);
    });
  }

  openStream(name: StreamName, session: string, listeners: StreamListeners): Stream {
    const number = ++this.last;
    const stream = { listeners, isOpen: false };
    this.streams.set(number, stream);
    this.post({ is: "open", stream: number, name, session });
    return {
      send: (data) => {
        if (stream.isOpen) this.post({ is: "data", stream: number, data });
        return stream.isOpen;
      },
      close: () => {
        stream.isOpen = false;
        if (this.streams.delete(number)) this.post({ is: "close", stream: number });
      },
    };
  }

  private post(message: ToWorker): void {
    this.worker.postMessage(message);
  }

  private start(): Worker {
    const worker = this.makeWorker();
    this.isReady = false;
    this.unanswered = 0;
    worker.onmessage = (event: MessageEvent<FromWorker>) => this.receive(event.data);
    worker.onerror = (event) => this.restart(event.message);
    void this.due.then(() => worker.postMessage({ is: "start", places: this.places } satisfies ToWorker));
    return worker;
  }

  private ping(): void {
    // While Python starts, the worker may take long for one thing.
    if (!this.isReady) return;
    if (this.unanswered >= this.mostUnanswered) {
      this.restart("it doesn't answer");
      return;
    }
    this.unanswered += 1;
    this.post({ is: "ping" });
  }

  private receive(message: FromWorker): void {
    this.unanswered = 0;
    if (message.is === "ready") {
      this.isReady = true;
      this.failures = 0;
      this.onState("ready");
    } else if (message.is === "answer") {
      const pending = this.pending.get(message.id);
      this.pending.delete(message.id);
      pending?.resolve(message.answer);
    } else if (message.is === "opened") {
      const stream = this.streams.get(message.stream);
      if (!stream) return;
      stream.isOpen = true;
      stream.listeners.onOpen();
    } else if (message.is === "data") {
      this.streams.get(message.stream)?.listeners.onMessage(message.data);
    } else if (message.is !== "pong") this.restart(message.reason);
  }

  /** Start the worker anew: streams end, and what was asked is asked again. */
  private restart(reason: string): void {
    console.warn(`Python is started again: ${reason}`);
    this.worker.terminate();
    if (!this.isReady) this.failures += 1;
    const failed = this.failures >= MOST_STARTS;
    this.onState(failed ? "failed" : "restarting");
    if (!failed) this.worker = this.start();
    for (const [id, pending] of this.pending) {
      if (!failed && pending.tries++ < MOST_TRIES) this.post(pending.message);
      else {
        this.pending.delete(id);
        pending.reject(new UnreachableError());
      }
    }
    const streams = [...this.streams.values()];
    this.streams.clear();
    for (const stream of streams) {
      stream.isOpen = false;
      stream.listeners.onClose();
    }
  }
}
