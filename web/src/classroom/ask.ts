/** Requests and streams between the pages of a class and its server. */

import type { DeskRequests, PupilRequests } from "../generated/classroom";
import type { ErrorAnswer, Sentence } from "../generated/messages";

/** The server refused a request, or doesn't answer: then `sentence` is null. */
export class ClassError extends Error {
  constructor(
    readonly code: string,
    readonly sentence: Sentence | null,
  ) {
    super(sentence?.en ?? code);
  }
}

const NO_ANSWER = "no-answer";
/** Where to go without a session. */
const DOORS: Record<string, string> = { "class-session-needed": "/join", "teacher-session-needed": "/desk" };

async function post(path: string, message: unknown): Promise<unknown> {
  const request = { method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(message ?? {}) };
  const response = await fetch(path, request).catch(() => null);
  if (response === null || (response.status >= 502 && response.status <= 504)) throw new ClassError(NO_ANSWER, null);
  const body: unknown = await response.json().catch(() => null);
  if (response.ok) return body;
  const { code, sentence } = (body as { error?: ErrorAnswer } | null)?.error ?? { code: NO_ANSWER, sentence: null };
  goToDoor(code);
  throw new ClassError(code, sentence);
}

function goToDoor(code: string): void {
  const door = DOORS[code];
  if (door && location.pathname !== door) location.assign(door);
}

/** A request of a pupil's page. Raises ClassError. */
export async function askClass<Name extends keyof PupilRequests>(
  name: Name,
  message?: PupilRequests[Name]["message"],
): Promise<PupilRequests[Name]["answer"]> {
  return (await post(`/api/class/${name}`, message)) as PupilRequests[Name]["answer"];
}

const FLOOD_TRIES = 20;
const FLOOD_WAIT_MS = 400;

/**
 * A request of a newcomer's page. Raises ClassError.
 *
 * Newcomers behind one router share the rate of its address: where another tablet there floods the server, they ask again.
 */
export async function askToJoin<Name extends keyof PupilRequests>(
  name: Name,
  message?: PupilRequests[Name]["message"],
): Promise<PupilRequests[Name]["answer"]> {
  for (let tries = 1; ; tries++) {
    try {
      return await askClass(name, message);
    } catch (problem) {
      if (!(problem instanceof ClassError && problem.code === "requests-too-fast") || tries === FLOOD_TRIES) throw problem;
      await new Promise((resolve) => setTimeout(resolve, FLOOD_WAIT_MS * (0.5 + Math.random())));
    }
  }
}

/** A request of the teacher's page. Raises ClassError. */
export async function askDesk<Name extends keyof DeskRequests>(
  name: Name,
  message?: DeskRequests[Name]["message"],
): Promise<DeskRequests[Name]["answer"]> {
  return (await post(`/api/desk/${name}`, message)) as DeskRequests[Name]["answer"];
}

interface Told {
  is: string;
  code?: string;
}

export interface StreamListeners<Answer extends Told> {
  onAnswer: (answer: Answer) => void;
  onBytes?: (bytes: ArrayBuffer) => void;
  onLink: (open: boolean) => void;
}

const FIRST_WAIT_MS = 500;
/** With its spread, a page is back within four seconds of its server. */
const LONGEST_WAIT_MS = 3000;
/** A connection that was silent for so long may be lost without a sign where the device slept or changed its network. */
const SILENT_MS = 6000;

/** A WebSocket of the class's server, opened again whenever it is lost; `close` ends it. */
export class Stream<Answer extends Told> {
  private socket: WebSocket | null = null;
  private timer: ReturnType<typeof setTimeout> | undefined;
  private waitMs = FIRST_WAIT_MS;
  private ended = false;
  private heardAt = Date.now();

  constructor(
    private readonly path: string,
    private readonly listeners: StreamListeners<Answer>,
  ) {
    this.connect();
    window.addEventListener("online", this.wake);
    document.addEventListener("visibilitychange", this.wake);
  }

  /** Begin anew where the device comes back and a silent connection may be one that is lost. */
  private readonly wake = (): void => {
    if (document.hidden || Date.now() - this.heardAt < SILENT_MS) return;
    const before = this.socket;
    clearTimeout(this.timer);
    this.connect();
    before?.close();
  };

  private connect(): void {
    const socket = new WebSocket(new URL(this.path, location.origin.replace(/^http/, "ws")));
    socket.binaryType = "arraybuffer";
    socket.onmessage = ({ data }: MessageEvent<string | ArrayBuffer>) => {
      this.waitMs = FIRST_WAIT_MS;
      this.heardAt = Date.now();
      this.listeners.onLink(true);
      if (typeof data !== "string") this.listeners.onBytes?.(data);
      else this.receive(JSON.parse(data) as Answer);
    };
    socket.onclose = () => {
      if (this.ended || this.socket !== socket) return;
      this.listeners.onLink(false);
      // Not all tablets of a class come back at the same moment.
      this.timer = setTimeout(() => this.connect(), this.waitMs * (0.75 + Math.random() / 2));
      this.waitMs = Math.min(this.waitMs * 2, LONGEST_WAIT_MS);
    };
    this.socket = socket;
  }

  private receive(answer: Answer): void {
    // Another page has the world now: who took it back at once would take turns with it.
    if (answer.is === "goodbye" || answer.code === "taken-over") this.close();
    if (answer.is === "error") goToDoor(answer.code ?? "");
    this.listeners.onAnswer(answer);
  }

  send(message: object): void {
    if (this.socket?.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(message));
  }

  close(): void {
    this.ended = true;
    clearTimeout(this.timer);
    window.removeEventListener("online", this.wake);
    document.removeEventListener("visibilitychange", this.wake);
    this.socket?.close();
  }
}
