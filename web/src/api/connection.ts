/** Requests to the server of a page, and streams that come back when they are lost. */

import { create } from "zustand";
import type { ErrorAnswer } from "../generated/messages";
import { RefusedError, type Stream, type StreamListeners, UnreachableError } from "./service";

/** The answer to a request; the text of a page. Throws RefusedError or UnreachableError. */
export async function post(path: string, message: unknown): Promise<unknown> {
  const request = { method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(message ?? {}) };
  const response = await fetch(path, request).catch(() => null);
  // A proxy between page and server answers 502 to 504 where the server itself is gone.
  if (response === null || (response.status >= 502 && response.status <= 504)) throw new UnreachableError();
  if (response.ok) return response.headers.get("Content-Type")?.startsWith("text/html") ? response.text() : response.json();
  const body = (await response.json().catch(() => null)) as { error?: ErrorAnswer } | null;
  const plain = `${response.status} ${response.statusText}`;
  throw new RefusedError(body?.error?.code ?? plain, body?.error?.sentence ?? { en: plain, zh: plain });
}

/** `blocked`: the network lets requests of this page through to its server, but no WebSocket. */
export const useSockets = create<{ blocked: boolean }>(() => ({ blocked: false }));

const BLOCKED_AFTER_MS = 6000;
/** Some proxies answer nothing at all. */
const MOST_OPENING_MS = 10_000;
let hasOpened = false;
let waiting: ReturnType<typeof setTimeout> | undefined;

/** Find out, once, why no WebSocket of this page has opened. */
async function lookWhetherBlocked(): Promise<void> {
  const response = await fetch(location.pathname).catch(() => null);
  useSockets.setState({ blocked: response?.ok === true && !hasOpened });
}

function noteOpened(): void {
  hasOpened = true;
  clearTimeout(waiting);
  useSockets.setState({ blocked: false });
}

/** Open a WebSocket of the page's server. */
export function openSocket(path: string, listeners: StreamListeners): Stream {
  const socket = new WebSocket(new URL(path, location.origin).href.replace(/^http/, "ws"));
  waiting ??= setTimeout(() => void lookWhetherBlocked(), BLOCKED_AFTER_MS);
  const opening = setTimeout(() => socket.close(), MOST_OPENING_MS);
  socket.addEventListener("open", () => {
    clearTimeout(opening);
    noteOpened();
  });
  const listening = new AbortController();
  const { signal } = listening;
  socket.binaryType = "arraybuffer";
  socket.addEventListener("open", listeners.onOpen, { signal });
  socket.addEventListener("message", ({ data }: MessageEvent<string | ArrayBuffer>) => listeners.onMessage(data), { signal });
  socket.addEventListener("close", listeners.onClose, { signal });
  return {
    send: (data) => {
      if (socket.readyState !== WebSocket.OPEN) return false;
      socket.send(data);
      return true;
    },
    close: () => {
      clearTimeout(opening);
      listening.abort();
      socket.close();
    },
  };
}

const FIRST_WAIT_MS = 500;
/** With its spread, a page is back within four seconds of its server. */
const LONGEST_WAIT_MS = 3000;

/** Make the k-th try after a wait, so that not all pages reach a server at once when it is back. */
export function tryLater(k: number, attempt: () => void): ReturnType<typeof setTimeout> {
  return setTimeout(attempt, Math.min(LONGEST_WAIT_MS, FIRST_WAIT_MS * 2 ** k) * (0.75 + Math.random() / 2));
}

/** A stream of messages that is opened again, later each time, whenever it is lost; `close` ends it, and `reopen` begins it anew. */
export class LastingStream<Answer> {
  private stream: Stream | null = null;
  private tries = 0;
  private timer: ReturnType<typeof setTimeout> | undefined;

  constructor(
    private readonly open: (listeners: StreamListeners) => Stream,
    private readonly receiver: { onAnswer: (answer: Answer) => void; onBytes?: (bytes: ArrayBuffer) => void; onOpen?: () => void; onClose?: () => void },
  ) {}

  /** Open it at once, in place of the one before. */
  reopen(): void {
    this.close();
    this.stream = this.open({
      onOpen: () => this.receiver.onOpen?.(),
      onMessage: (data) => {
        this.tries = 0;
        if (typeof data === "string") this.receiver.onAnswer(JSON.parse(data) as Answer);
        else this.receiver.onBytes?.(data);
      },
      onClose: () => this.lose(),
    });
  }

  /** Send a message; false while the connection is lost. */
  send(message: object): boolean {
    return this.stream?.send(JSON.stringify(message)) ?? false;
  }

  close(): void {
    clearTimeout(this.timer);
    this.stream?.close();
  }

  /** Close it as if it were lost: it is opened again after a wait. */
  lose(): void {
    this.close();
    this.timer = tryLater(this.tries, () => this.reopen());
    this.tries += 1;
    this.receiver.onClose?.();
  }
}
