/** What answers the page: a server, or a worker of this browser. The page uses this interface alone and can't tell which it is. */

import type { Requests, Sentence } from "../generated/messages";

/** The request was refused; the sentence says why. */
export class RefusedError extends Error {
  constructor(
    readonly code: string,
    readonly sentence: Sentence,
  ) {
    super(sentence.en);
  }
}

/** Nothing answers. */
export class UnreachableError extends Error {}

/**
 * Whether requests are answered: `starting`, they wait until the service is ready for the first time; `restarting`, they
 * wait because it ended and begins again by itself; `gone`, they fail until it answers again; `failed`, for good.
 */
export type ServiceState = "starting" | "ready" | "restarting" | "gone" | "failed";

/**
 * `world`: a world in play; `trials`: its program on other seeds, and two runs compared; `upload`: a transfer through a
 * port of the service; `serial`: one through a port of this page.
 */
export type StreamName = "world" | "trials" | "upload" | "serial";

export interface StreamListeners {
  onOpen: () => void;
  /** A text is JSON; bytes are a picture, or for the page's serial port. */
  onMessage: (data: string | ArrayBuffer) => void;
  /** The other end has closed the stream, or is lost; not called after `close`. */
  onClose: () => void;
}

export interface Stream {
  /** Send a text (JSON) or the bytes of a port; false where the stream isn't open. */
  send(data: string | Uint8Array<ArrayBuffer>): boolean;
  close(): void;
}

export interface Service {
  /** Answer a request. Throws RefusedError or UnreachableError. */
  ask<Name extends keyof Requests>(name: Name, message: Requests[Name]["message"] | null): Promise<Requests[Name]["answer"]>;
  /** Open a stream; `session` names the world of one window. It may open later, or close at once. */
  openStream(name: StreamName, session: string, listeners: StreamListeners): Stream;
}

/** What answers this page. */
export let service: Service;

/** Say what answers this page; call it once, before anything else. */
export function connectTo(answers: Service): void {
  service = answers;
}

/** Ask what answers this page. Throws RefusedError or UnreachableError. */
export function request<Name extends keyof Requests>(
  name: Name,
  message: Requests[Name]["message"] | null = null,
): Promise<Requests[Name]["answer"]> {
  return service.ask(name, message);
}
