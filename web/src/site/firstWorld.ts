/**
 * The world's stream while Python starts: the page gets the opening's recorded pictures, and Python takes the world over.
 *
 * Python runs the same world to the picture that is shown, and gets every bit of it; from the next one on the pictures are
 * Python's. What only Python can do, such as to move a car, waits for it: the world stands still then, so that it happens
 * at the moment at which it was asked for. Where the recording ends, the world waits too.
 */

import { type Answer, type Command, decodePicture } from "../api/world";
import type { Stream, StreamListeners } from "../api/service";
import type { Opening, Recording } from "./opening";

const PICTURE_MS = 1000 / 30;
/** As `motorcade.service.world_session` has them: a page that was late catches up with so much; ticks in a step. */
const MOST_BEHIND_MS = 250;
const MOST_TICKS_A_STEP = 100;
const ALL_PICTURES = 0xffffffff;

type Open = (listeners: StreamListeners) => Stream;
type Set = Command & { do: "set" };
type State = Answer & { is: "state" };

/** A recording at the picture that is shown last. */
interface Playback extends Recording {
  /** The place of the next message. */
  next: number;
  tMs: number;
  state: State;
  behindMs: number;
  timer?: ReturnType<typeof setInterval>;
}

export class FirstWorld implements Stream {
  private python: Stream;
  private isOpen = false;
  private isHandedOver = false;
  private isClosed = false;
  private set: Set | null = null;
  private now: Playback | null = null;
  /** How far Python was told to run; null before it has the world. */
  private toldMs: number | null = null;
  /** What Python says that cars think. */
  private thoughts: Answer = { is: "thoughts", thoughts: [] };
  /** What waits for Python, in order; the world stands still since the first of it. */
  private held: Command[] = [];
  private watched: Command | null = null;

  /**
   * @param opening has the recording.
   * @param session the name of the world's session.
   * @param listeners the page.
   * @param open opens the stream to Python, which opens when Python is ready.
   * @param onDrawn called when the page has drawn a picture.
   */
  constructor(
    private readonly opening: Opening,
    private readonly session: string,
    private readonly listeners: StreamListeners,
    private readonly open: Open,
    private readonly onDrawn: () => void,
  ) {
    this.python = this.openPython();
    queueMicrotask(() => {
      if (this.isClosed) return;
      listeners.onOpen();
      this.answer(this.noWorld);
    });
  }

  private get noWorld(): Answer {
    return { is: "hello", session: this.session, resumed: false, cars: 0 };
  }

  private openPython(): Stream {
    return this.open({
      onOpen: () => this.beginHandOver(),
      onMessage: (data) => this.receive(data),
      onClose: () => {
        if (this.isHandedOver) this.listeners.onClose();
        else if (!this.isClosed) {
          // Python begins again.
          this.isOpen = false;
          this.toldMs = null;
          this.python = this.openPython();
        }
      },
    });
  }

  send(data: string | Uint8Array<ArrayBuffer>): boolean {
    if (this.isHandedOver) return this.python.send(data);
    const message = JSON.parse(data as string) as Command;
    if (message.do === "set") this.begin(message);
    else if (message.do === "watch") this.watched = message;
    else if (message.do === "shown") this.onDrawn();
    else if (this.held.length > 0 || !this.now || !this.play(this.now, message)) {
      this.held.push(message);
      clearInterval(this.now?.timer);
    }
    return true;
  }

  close(): void {
    this.isClosed = true;
    clearInterval(this.now?.timer);
    this.python.close();
  }

  private begin(set: Set): void {
    clearInterval(this.now?.timer);
    this.set = set;
    this.held = [];
    if (this.isOpen) {
      this.finish(set);
      return;
    }
    const recording = this.opening.recording(set, this.session);
    if (!recording) {
      this.now = null;
      this.answer(this.noWorld);
      return;
    }
    const state = recording.messages[0] as State;
    this.now = { ...recording, next: 0, tMs: 0, state, behindMs: 0 };
    this.answer(recording.hello);
    this.advance(this.now);
    this.tell(this.now);
  }

  /** Do what the page asks; false where only Python can. */
  private play(now: Playback, message: Command): boolean {
    if (message.do === "play") this.start(now, message.speed ?? 1);
    else if (message.do === "pause") this.stop(now);
    else if (message.do === "reset" && message.seed === now.state.seed && !message.until_ms && !this.isOpen) this.begin(this.set!);
    else return false;
    this.tell(this.now!);
    return true;
  }

  private start(now: Playback, speed: number): void {
    this.stop(now);
    now.state = { ...now.state, playing: true, speed, rate: speed };
    let advanced = performance.now();
    now.timer = setInterval(() => {
      const time = performance.now();
      now.behindMs = Math.min(now.behindMs + (time - advanced) * speed, MOST_BEHIND_MS * speed);
      advanced = time;
      this.advance(now);
    }, PICTURE_MS);
  }

  private stop(now: Playback): void {
    clearInterval(now.timer);
    now.behindMs = 0;
    now.state = { ...now.state, playing: false, rate: 0 };
  }

  /** Pass on what is due: all pictures, as each has events of its own, and the answers after them. */
  private advance(now: Playback): void {
    for (; now.next < now.messages.length; now.next += 1) {
      const message = now.messages[now.next]!;
      if (message instanceof ArrayBuffer) {
        const { tMs } = decodePicture(message)!;
        if (tMs > now.tMs + now.behindMs) return;
        now.behindMs -= tMs - now.tMs;
        now.tMs = tMs;
        this.listeners.onMessage(message);
      } else if (message.is === "state") {
        const { playing, speed, rate } = now.state;
        now.state = { ...message, playing, speed, rate };
        this.tell(now);
      } else this.answer(message);
    }
  }

  private tell({ state, tMs }: Playback): void {
    this.answer({ ...state, t_ms: tMs });
  }

  private answer(answer: Answer): void {
    this.listeners.onMessage(JSON.stringify(answer));
  }

  // Python takes the world over.

  private order(...messages: Command[]): void {
    for (const message of messages) this.python.send(JSON.stringify(message));
  }

  private beginHandOver(): void {
    this.isOpen = true;
    if (!this.now) this.finish(...(this.set ? [this.set] : []));
    else {
      this.order(this.set!, { do: "reset", seed: this.now.state.seed, until_ms: this.now.tMs });
      this.toldMs = this.now.tMs;
    }
  }

  private receive(data: string | ArrayBuffer): void {
    if (this.isHandedOver) this.listeners.onMessage(data);
    else if (typeof data === "string") {
      const answer = JSON.parse(data) as Answer;
      if (answer.is === "thoughts") this.thoughts = answer;
    } else if (this.now) this.receivePicture(this.now, decodePicture(data)!.tMs);
  }

  /** Python is at a picture, which the page has already, with all that happened until then. */
  private receivePicture(now: Playback, tMs: number): void {
    this.order({ do: "shown", frame: ALL_PICTURES });
    if (tMs !== this.toldMs) return;
    // From here on the world waits.
    clearInterval(now.timer);
    const tickMs = now.hello.tick_ms!;
    let missing = (now.tMs - tMs) / tickMs;
    this.toldMs = now.tMs;
    if (missing === 0) {
      const { playing, speed } = now.state;
      this.answer(this.thoughts);
      this.finish(...(playing ? [{ do: "play", speed } as const] : []));
    }
    for (; missing > 0; missing -= MOST_TICKS_A_STEP) this.order({ do: "step", ticks: Math.min(MOST_TICKS_A_STEP, missing) });
  }

  /** From now on the page talks with Python alone. */
  private finish(...messages: Command[]): void {
    this.isHandedOver = true;
    this.order(...messages, ...this.held, ...(this.watched ? [this.watched] : []));
    this.now = null;
  }
}
