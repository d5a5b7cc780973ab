/** The page's side of its world: sends the server what differs from what it has, and takes its answers and pictures. */

import { type Answer, type Command, type WorldHello, type Picture, type Pose, poseIn, type WorldState } from "../api/world";
import { type LinkState, sessionOfWindow, WorldConnection } from "../api/worldConnection";
import type { Playing } from "../pair/store";
import { keep } from "../state/storage";
import { useStudio } from "../state/studio";
import { endAll, isCalm } from "../ui/areas";
import { EventStore } from "../timeline/events";
import { runningBlocks, sameRunning } from "./account";
import { beginning, type CarPoses } from "./cars";
import type { Mat } from "./document";
import { catchUp, isAt } from "./following";
import { type Miss, MissedWords } from "./missed";
import { type PlayEvent, stateAfter, TO_PLAY } from "./play";
import { runNow } from "./run";
import { chosenCar, useMat } from "./store";

const BEGINNING_KEY = "motorcade.world.beginning";
const SEED_KEY = "motorcade.world.seed";
const SYNC_MS = 120;
const SEEK_MS = 25;
const SHOW_EVERY_MS = 120;
/** A car that has driven for so long is seen to drive. */
const DRIVEN_MS = 100;

/** What changes how a world is played, as an event of this page's play; a partner's page does the same. */
const CONDUCTED: Partial<Record<Command["do"], PlayEvent>> = { play: "play", pause: "pause", step: "pause", reset: "pause", seek: "pause" };
export class Session {
  readonly events = new EventStore();
  readonly missed = new MissedWords();
  /** Where the cars stood at the beginning, once a picture showed it. */
  starts: CarPoses | null = null;
  picture: Picture | null = null;
  /**
   * Called with the state of the world after this page's user has played, paused, stepped, begun again or sought, and
   * where a run has begun or ended by itself.
   */
  onCommand: ((state: WorldState) => void) | null = null;

  /** Resolved when the stage was drawn, and, where cars are to drive at once, shows that they do. */
  readonly drawn: Promise<void>;
  private resolveDrawn!: () => void;
  private readonly listeners = new Set<(picture: Picture, missed: readonly Miss[]) => void>();
  private connection: WorldConnection | null = null;
  private unsubscribe: (() => void) | null = null;
  /** What the world has of the project; null until it answers. `isResumed`: it was there before this page; `isMoved`: cars have other starts. */
  private sent: { beginning: string | null; mat: Mat | null; rangeMm: number | null; isResumed?: boolean; isMoved?: boolean } | null = null;
  /** How the partner's page plays, to be done once the world stands. */
  private followed: Playing | null = null;
  private followedAt = 0;
  /** A command, or a new run, awaits its state. */
  private awaited = false;
  private timer: ReturnType<typeof setTimeout> | undefined;
  private seeking: ReturnType<typeof setTimeout> | undefined;
  private showing: ReturnType<typeof setTimeout> | undefined;
  private shownAt = 0;

  constructor() {
    this.drawn = new Promise((resolve) => (this.resolveDrawn = resolve));
    // Traces show it, and benchmarks wait for it.
    void this.drawn.then(() => performance.mark("motorcade: drawn"));
  }

  /** What the server calls it. */
  get name(): string {
    return sessionOfWindow();
  }

  /** Connect, and send each change of the program and the mat. */
  open(): void {
    // Where the world ends with its page, a reloaded page begins the same run again.
    useMat.setState({ seed: Number(sessionStorage.getItem(SEED_KEY)) || 0 });
    this.unsubscribe = endAll(
      useMat.subscribe(({ seed, chosen }, before) => {
        if (seed !== before.seed) keep("sessionStorage", SEED_KEY, String(seed));
        if (chosen !== before.chosen) this.watch();
      }),
      useStudio.subscribe((now, before) => {
        const differs =
          now.compiled?.image !== before.compiled?.image || now.profile !== before.profile || now.car !== before.car || now.mission !== before.mission;
        // The first program is no edit, of which there come many.
        if (differs && this.sent?.beginning === null && now.compiled) this.syncNow();
        else if (differs || now.mat !== before.mat || now.rangeMm !== before.rangeMm) this.sync();
      }),
    );
    if (useStudio.getState().isOpening && !isCalm()) this.take("play");
    this.connection = new WorldConnection(this.name, {
      onPicture: (picture) => this.receivePicture(picture),
      onAnswer: (answer) => this.receive(answer),
      onLink: (link) => this.linkChanged(link),
    });
  }

  close(): void {
    this.unsubscribe?.();
    clearTimeout(this.timer);
    clearTimeout(this.seeking);
    clearTimeout(this.showing);
    this.connection?.close();
  }

  /** Call back with each picture and the words that were missed for good, which is too often for React; returns a function that ends this. */
  listen(listener: (picture: Picture, missed: readonly Miss[]) => void): () => void {
    this.listeners.add(listener);
    return () => this.listeners.delete(listener);
  }

  comeBack(): void {
    this.connection?.comeBack();
  }

  /** Send what differs, a moment later: edits come in bursts. */
  sync(): void {
    clearTimeout(this.timer);
    this.timer = setTimeout(() => this.syncNow(), SYNC_MS);
  }

  shown(frame: number): void {
    this.connection?.send({ do: "shown", frame });
    if (!this.plays || (this.picture?.tMs ?? 0) >= DRIVEN_MS) this.resolveDrawn();
  }

  /** Send what this page's user wants. */
  send(command: Command): void {
    const event = CONDUCTED[command.do];
    if (event) {
      this.awaited = true;
      this.take(event);
    }
    this.pass(command);
  }

  private pass(command: Command): void {
    this.connection?.send(command);
  }

  /** Take an event of `play.ts`. */
  private take(event: PlayEvent): void {
    const { play } = useMat.getState();
    const next = stateAfter(play, event);
    if (next !== play) useMat.setState({ play: next });
  }

  /** Whether the world plays, or will as soon as it can. */
  get plays(): boolean {
    return TO_PLAY.has(useMat.getState().play);
  }

  play(): void {
    this.send({ do: "play", speed: useMat.getState().speed });
  }

  /** Another project is opened: its world stands at its beginning until somebody lets it play. */
  stand(): void {
    this.take("open");
    this.pass({ do: "pause" });
    // It begins anew even where it is the same world.
    if (this.sent) this.sent = { ...this.sent, beginning: null };
    this.sync();
  }

  setSpeed(speed: number): void {
    useMat.setState({ speed });
    if (useMat.getState().play === "playing") this.play();
  }

  reset(): void {
    if (this.sent?.isMoved) {
      this.awaited = true;
      this.take("pause");
      this.begin();
    } else this.send({ do: "reset", seed: useMat.getState().seed });
  }

  /** Put a car elsewhere; `mat` where that is its new start. */
  move(car: number, pose: Pose, mat: Mat | null): void {
    this.send({ do: "move", car, ...pose });
    if (!mat || !this.sent) return;
    this.sent = { ...this.sent, beginning: this.beginningWith(mat), mat, isMoved: true };
  }

  private beginningWith(mat: Mat): string {
    const { compiled, profile, car, mission } = useStudio.getState();
    return JSON.stringify([compiled?.image ?? null, profile, car, beginning(mat), mission, ...(compiled?.counters ?? [])]);
  }

  private syncNow(): void {
    clearTimeout(this.timer);
    const { mat, rangeMm, compiled } = useStudio.getState();
    // After a reload the connection to the running world is back before its program is compiled.
    if (!this.sent || (this.sent.isResumed && !compiled)) return;
    if (this.sent.beginning !== this.beginningWith(mat)) this.begin();
    else if (this.sent.mat !== mat || this.sent.rangeMm !== rangeMm) {
      useMat.setState({ problem: null });
      this.send({ do: "set_environment", mat, range_mm: rangeMm });
      this.sent = { ...this.sent, mat, rangeMm };
    }
  }

  /** Set a new world, which plays if the one before did, once its program is compiled. */
  private begin(): void {
    const { mat, rangeMm, compiled } = useStudio.getState();
    useMat.setState({ problem: null, goals: null });
    this.take("edit");
    this.pass({ do: "set", ...runNow() });
    this.sent = { beginning: this.beginningWith(mat), mat, rangeMm };
    keep("sessionStorage", BEGINNING_KEY, this.sent.beginning!);
    this.starts = null;
    if (this.plays && compiled) this.pass({ do: "play", speed: useMat.getState().speed });
  }

  /** Play as the partner's page does: the same run at the same time. */
  follow(playing: Playing): void {
    const { state } = useMat.getState();
    if (state && isAt(state, playing)) return;
    this.followed = playing;
    this.followedAt = performance.now();
    useMat.setState({ speed: playing.speed, seed: playing.seed });
    this.take("follow");
    this.pass({ do: "pause" });
  }

  /** The world stands at the time of `state`: bring it to where the partner's page is. */
  private catchUp(followed: Playing, state: WorldState): void {
    const tickMs = useMat.getState().hello?.tick_ms ?? 1;
    for (const command of catchUp(followed, state, tickMs, performance.now() - this.followedAt)) this.pass(command);
    if (followed.playing) this.take("play");
  }

  /** Show a stored moment; null for the present. Scrubbing asks for more than can be shown: only the newest is sent. */
  seek(tMs: number | null): void {
    clearTimeout(this.seeking);
    this.seeking = setTimeout(() => this.send({ do: "seek", t_ms: tMs }), SEEK_MS);
  }

  /** Ask for what the chosen car tells; of a new car, once the world has it. */
  private watch(): void {
    const car = chosenCar();
    if (car !== null && car >= (useMat.getState().hello?.cars ?? 0)) return;
    this.pass({ do: "watch", car });
    this.show();
  }

  private linkChanged(link: LinkState): void {
    if (link !== "open") this.sent = null;
    if (link === "lost" || link === "elsewhere") this.take(link === "lost" ? "lost" : "taken");
    useMat.setState({ link });
  }

  private receive(answer: Answer): void {
    if (answer.is === "hello") this.receiveHello(answer);
    if (answer.is === "state") this.receiveState(answer);
    if (answer.is === "car" && answer.car === chosenCar()) useMat.setState({ details: answer });
    if (answer.is === "thoughts") useMat.setState({ thoughts: answer.thoughts });
    if (answer.is === "decisions") useMat.setState({ decisions: answer.leaders });
    if (answer.is === "goals") {
      useMat.setState({ goals: answer });
      if (answer.is_over) this.end();
    }
    if (answer.is === "stopped") {
      useMat.setState({ stopped: answer, told: [answer.car, ...answer.others] });
      this.end();
    }
    if (answer.is === "error") useMat.setState({ problem: answer });
  }

  /** The run has ended by itself, at the state that came just before. */
  private end(): void {
    const { play: before, state } = useMat.getState();
    this.take("over");
    if (state && useMat.getState().play !== before) this.onCommand?.(state);
  }

  private receiveState(state: WorldState): void {
    const tMs = state.shown_ms ?? state.t_ms;
    // Whoever plays on, or begins again, has seen why the world stopped.
    useMat.setState({ state, tMs, seed: state.seed, ...(state.playing && { speed: state.speed, stopped: null }) });
    // What the world says meanwhile is about the time before.
    if (this.awaited && state.playing === this.plays) {
      this.awaited = false;
      this.onCommand?.(state);
    }
    const { play: before } = useMat.getState();
    // The state may be that of the world before: until its program is compiled, none counts, but of this page's own world.
    if (useStudio.getState().compiled || this.sent?.isResumed) this.take(eventOf(state));
    if (before === "following" && useMat.getState().play !== before) this.catchUp(this.followed!, state);
  }

  private receiveHello(hello: WorldHello): void {
    const isNew = !this.sent;
    if (isNew) {
      const stored = hello.resumed ? sessionStorage.getItem(BEGINNING_KEY) : null;
      this.sent = { beginning: stored, mat: null, rangeMm: null, isResumed: hello.resumed };
    } else if (hello.cars) {
      this.take("world");
      this.awaited ||= this.plays;
    }
    // A canvas that is made only now must not draw the cars of the world before.
    if (this.picture && this.picture.cars !== hello.cars) {
      this.drop(this.picture);
      this.picture = null;
    }
    const car = chosenCar();
    useMat.setState({ hello, details: null, thoughts: [], decisions: [], ...(car !== null && car >= hello.cars && { chosen: null }) });
    if (car !== null && car < hello.cars) this.watch();
    // It was told to stand while nothing was there to hear it.
    if (isNew && useMat.getState().play === "following") this.pass({ do: "pause" });
    // Its answer may come at once.
    if (isNew && useStudio.getState().compiled) this.syncNow();
    else if (isNew) this.sync();
  }

  /** A picture is never drawn: the server, which waits for drawings, must not wait for this one. */
  private readonly drop = ({ frame }: Picture) => this.connection?.send({ do: "shown", frame });

  private receivePicture(picture: Picture): void {
    if (picture.cars !== useMat.getState().hello?.cars) {
      this.drop(picture);
      return;
    }
    this.picture = picture;
    if (picture.tMs === 0 && !picture.past) this.starts = picture;
    this.events.take(picture);
    const missed = this.missed.take(picture);
    for (const listener of this.listeners) listener(picture, missed);
    const { compiled, running: before } = useStudio.getState();
    const running = runningBlocks(picture, compiled?.words ?? []);
    if (!sameRunning(running, before)) useStudio.setState({ running });
    const isJump = picture.past || picture.fresh || useMat.getState().past;
    const wait = isJump ? 0 : this.shownAt + SHOW_EVERY_MS - performance.now();
    clearTimeout(this.showing);
    if (wait <= 0) this.show();
    else this.showing = setTimeout(() => this.show(), wait);
  }

  /** Copy what the newest picture shows into the store, which React follows; after a burst the last one always. */
  private show(): void {
    const { picture } = this;
    if (!picture) return;
    this.shownAt = performance.now();
    const car = chosenCar();
    useMat.setState({ tMs: picture.tMs, past: picture.past, pose: car === null ? null : poseIn(picture, car) });
  }
}

/** What a state of the world says about its play. */
function eventOf({ playing, shown_ms: shown }: WorldState): PlayEvent {
  if (playing) return "plays";
  return shown === null ? "stands" : "past";
}

/** That of this page. */
export const session = new Session();
