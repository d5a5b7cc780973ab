/**
 * The world's stream while Python starts: the page steps the opening's world, and Python takes it over at a tick.
 *
 * Python runs the same world from its beginning to that tick, and gets every bit of it. What only Python can do, such as
 * to move a car, waits for it: the world stands still then, so that it happens at the tick at which it was asked for.
 */

import { type Answer, type Command, decodePicture } from "../api/world";
import type { Stream, StreamListeners } from "../api/service";
import type { Opening } from "./opening";

const PICTURE_MS = 1000 / 30;
const STATE_MS = 250;
/** As `motorcade.service.world_session` has them. */
const MOST_BEHIND_MS = 250;
const MOST_PICTURES_UNDER_WAY = 2;
const MOST_TICKS_A_STEP = 100;
const ALL_PICTURES = 0xffffffff;

type Open = (listeners: StreamListeners) => Stream;
type Set = Command & { do: "set" };
type Playing = NonNullable<ReturnType<Opening["world"]>> & { timer?: ReturnType<typeof setInterval>; behindMs: number; sent: number; drawn: number };

export class FirstWorld implements Stream {
  private python: Stream;
  private isOpen = false;
  private isHandedOver = false;
  private isClosed = false;
  private set: Set | null = null;
  private now: Playing | null = null;
  /** How many ticks Python was told to run. */
  private told = 0;
  /** What waits for Python, in order; the world stands still since the first of it. */
  private held: Command[] = [];
  private watched: Command | null = null;

  /**
   * @param opening has the world.
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
    private readonly onDrawn: () => void = () => undefined,
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
          this.told = 0;
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
    else if (message.do === "shown") {
      if (this.now) this.now.drawn = message.frame;
      this.onDrawn();
    } else if (this.held.length > 0 || !this.now || !this.play(this.now, message)) this.held.push(message);
    return true;
  }

  close(): void {
    this.isClosed = true;
    this.stop();
    this.python.close();
  }

  private begin(set: Set): void {
    this.stop();
    this.set = set;
    this.held = [];
    if (this.isOpen) {
      this.finish(set);
      return;
    }
    const begun = this.opening.world(set, this.session);
    this.now = begun && { ...begun, behindMs: 0, sent: 0, drawn: 0 };
    if (!this.now) {
      this.answer(this.noWorld);
      return;
    }
    this.answer(this.now.hello);
    this.tell(this.now);
    this.show(this.now);
  }

  /** Do what the page asks; false where only Python can. */
  private play(now: Playing, message: Command): boolean {
    if (message.do === "play") this.start(now, message.speed ?? 1);
    else if (message.do === "pause") this.stop();
    else if (message.do === "step") {
      this.stop();
      now.world.run(message.ticks ?? 1);
      this.show(now);
    } else if (message.do === "reset" && message.seed === now.state.seed && !message.until_ms && !this.isOpen) this.begin(this.set!);
    else return false;
    this.tell(this.now!);
    return true;
  }

  private start(now: Playing, speed: number): void {
    this.stop();
    now.state = { ...now.state, playing: true, speed, rate: speed };
    let advanced = performance.now();
    let told = advanced;
    now.timer = setInterval(() => {
      // What waits for Python happens at this tick.
      if (this.held.length > 0) return;
      const time = performance.now();
      now.behindMs = Math.min(now.behindMs + (time - advanced) * speed, MOST_BEHIND_MS * speed);
      advanced = time;
      const ticks = Math.floor(now.behindMs / now.hello.tick_ms!);
      now.behindMs -= ticks * now.hello.tick_ms!;
      now.world.run(ticks);
      this.show(now);
      if (time - told < STATE_MS) return;
      told = time;
      this.tell(now);
    }, PICTURE_MS);
  }

  private stop(): void {
    clearInterval(this.now?.timer);
    if (this.now) this.now.state = { ...this.now.state, playing: false, rate: 0 };
  }

  private show(now: Playing): void {
    // Before the stage is there, nothing is drawn, and the newest picture is kept for it.
    if (now.drawn > 0 && now.sent - now.drawn >= MOST_PICTURES_UNDER_WAY) return;
    now.sent += 1;
    this.listeners.onMessage(now.world.picture());
  }

  private tell({ state, world }: Playing): void {
    this.answer({ ...state, t_ms: world.tMs });
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
      this.order(this.set!);
      this.catchUp(this.now);
    }
  }

  /** Let Python run as far as the world here is. */
  private catchUp({ world }: Playing): void {
    for (; this.told < world.tick; this.told = Math.min(this.told + MOST_TICKS_A_STEP, world.tick)) {
      this.order({ do: "step", ticks: Math.min(MOST_TICKS_A_STEP, world.tick - this.told) });
    }
  }

  private receive(data: string | ArrayBuffer): void {
    if (this.isHandedOver) this.listeners.onMessage(data);
    else if (this.now && typeof data !== "string") {
      // Python makes the next picture; the page has these already.
      this.order({ do: "shown", frame: ALL_PICTURES });
      const { world, state, timer, hello } = this.now;
      // All that happened until then was in Python's pictures, too.
      if (decodePicture(data)?.tMs !== this.told * hello.tick_ms!) return;
      clearInterval(timer);
      if (this.told < world.tick) {
        this.catchUp(this.now);
        return;
      }
      this.listeners.onMessage(world.picture());
      this.finish(...(state.playing ? [{ do: "play", speed: state.speed } as const] : []));
    }
  }

  /** From now on the page talks with Python alone. */
  private finish(...messages: Command[]): void {
    this.isHandedOver = true;
    this.order(...messages, ...this.held, ...(this.watched ? [this.watched] : []));
    this.now = null;
  }
}
