/** The connection to a world of cars in play, which comes back by itself, and the session by which it is found again. */

import { LastingStream } from "./connection";
import { heldByOthers, own } from "../state/otherTabs";
import { keep } from "../state/storage";
import { service, type Stream, type StreamListeners } from "./service";
import { type Answer, type Command, decodePicture, type Picture } from "./world";

export type LinkState = "connecting" | "open" | "lost" | "elsewhere";

interface Listeners {
  onPicture: (picture: Picture) => void;
  onAnswer: (answer: Answer) => void;
  onLink: (link: LinkState) => void;
}

const SESSION_KEY = "motorcade.world";
/** Another page has this world, or its place, now; to connect again at once would take it from that page. */
const GIVEN_AWAY = ["taken-over", "session-was-idle"];

/** The session of this window's world: the same after a reload, another one in another window. */
export function sessionOfWindow(): string {
  const stored = sessionStorage.getItem(SESSION_KEY);
  if (stored !== null && /^[0-9a-f]{32}$/.test(stored)) return stored;
  const session = uniqueName();
  keep("sessionStorage", SESSION_KEY, session);
  return session;
}

/** Give this window a world of its own, where that of its session is another tab's, of which this one is a copy. */
export async function takeOwnWorld(): Promise<void> {
  const before = sessionStorage.getItem(SESSION_KEY);
  if (before !== null && (await heldByOthers()).has(before)) sessionStorage.removeItem(SESSION_KEY);
  own.world = sessionOfWindow();
}

/** A connection that comes back by itself until it is closed. */
export class WorldConnection {
  private readonly stream: LastingStream<Answer>;

  constructor(
    readonly session: string,
    private readonly listeners: Listeners,
    openStream = (stream: StreamListeners): Stream => service.openStream("world", session, stream),
  ) {
    const open = (stream: StreamListeners) => {
      listeners.onLink("connecting");
      return openStream(stream);
    };
    this.stream = new LastingStream<Answer>(open, {
      onAnswer: (answer) => this.receive(answer),
      onBytes: (bytes) => {
        const picture = decodePicture(bytes);
        if (picture) listeners.onPicture(picture);
      },
      onOpen: () => listeners.onLink("open"),
      onClose: () => listeners.onLink("lost"),
    });
    this.stream.reopen();
  }

  /** Send a message; false while the connection is lost. The page sends what differs after the next hello. */
  send(command: Command): boolean {
    return this.stream.send(command);
  }

  /** Take the world back from another window. */
  comeBack(): void {
    document.removeEventListener("visibilitychange", this.comeBackWhenSeen);
    this.stream.reopen();
  }

  /** Who comes back to this tab wants its world here. */
  private readonly comeBackWhenSeen = (): void => {
    if (!document.hidden) this.comeBack();
  };

  close(): void {
    document.removeEventListener("visibilitychange", this.comeBackWhenSeen);
    this.stream.close();
  }

  private receive(answer: Answer): void {
    this.listeners.onAnswer(answer);
    if (answer.is !== "error" || !GIVEN_AWAY.includes(answer.code)) return;
    this.stream.close();
    document.addEventListener("visibilitychange", this.comeBackWhenSeen);
    this.listeners.onLink("elsewhere");
  }
}

export function uniqueName(): string {
  const bytes = crypto.getRandomValues(new Uint8Array(16));
  return Array.from(bytes, (byte) => byte.toString(16).padStart(2, "0")).join("");
}
