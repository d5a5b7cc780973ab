/** The page's side of its world: tells the server what differs from what it knows, and hands on what it answers. */

import type { CompiledWord } from "../api/types";
import {
  type Answer,
  type Command,
  type Hello,
  type Link,
  type Picture,
  type Pose,
  poseIn,
  sessionOfWindow,
  WorldConnection,
  type WorldState,
} from "../api/world";
import { EventStore } from "../timeline/events";
import { beginning } from "./cars";
import type { Mat } from "./document";
import type { Placed } from "./cars";
import { runningBlocks, type Running, sameRunning } from "./running";
import { chosenCar, type OnPicture, useMat } from "./store";

const KEPT_BEGINNING = "motorcade.world.beginning";
const SYNC_MS = 120;
const SEEK_MS = 25;
const TOLD_EVERY_MS = 120;
/** After a reload the blocks come later than the world that still runs them. */
const PATIENCE_MS = 4000;

export interface Program {
  image: string | null;
  words: readonly CompiledWord[];
  profile: string;
}

/** A short sign of a long text: equal texts have equal signs. */
function signOf(text: string): string {
  let sign = 0x811c9dc5;
  for (let k = 0; k < text.length; k++) sign = Math.imul(sign ^ text.charCodeAt(k), 0x01000193);
  return `${text.length}:${sign >>> 0}`;
}

export class Session {
  readonly name = sessionOfWindow();
  readonly events = new EventStore();
  /** Where the cars stood at the beginning, once that was seen. */
  starts: Placed | null = null;
  picture: Picture | null = null;
  onPicture: OnPicture | null = null;
  onHello: ((hello: Hello) => void) | null = null;

  private connection: WorldConnection | null = null;
  private onRunning: ((running: Running) => void) | null = null;
  private program: Program = { image: null, words: [], profile: "classroom" };
  private running: Running = new Map();
  private told: { beginning: string | null; mat: Mat | null; rangeMm: number | null } | null = null;
  private movedStarts = false;
  /** To play was asked for, and no state of the world tells of it yet. */
  private asked = false;
  private patientUntil = 0;
  private timer: ReturnType<typeof setTimeout> | undefined;
  private seeking: ReturnType<typeof setTimeout> | undefined;
  private telling: ReturnType<typeof setTimeout> | undefined;
  private toldAt = 0;

  open(): void {
    this.connection = new WorldConnection(this.name, {
      onPicture: (picture) => this.take(picture),
      onAnswer: (answer) => this.hear(answer),
      onLink: (link) => this.linked(link),
    });
  }

  close(): void {
    clearTimeout(this.timer);
    clearTimeout(this.seeking);
    clearTimeout(this.telling);
    this.connection?.close();
  }

  comeBack(): void {
    this.connection?.comeBack();
  }

  tellRunning(onRunning: (running: Running) => void): void {
    this.onRunning = onRunning;
  }

  setProgram(program: Program): void {
    this.program = program;
    this.sync();
  }

  /** Tell the server what differs, a moment later: edits come in bursts. */
  sync(): void {
    clearTimeout(this.timer);
    this.timer = setTimeout(() => this.syncNow(), SYNC_MS);
  }

  shown(frame: number): void {
    this.connection?.send({ do: "shown", frame });
  }

  say(command: Command): void {
    this.asked = command.do === "play" || (this.asked && command.do !== "pause");
    this.connection?.send(command);
  }

  play(): void {
    this.say({ do: "play", speed: useMat.getState().speed });
  }

  setSpeed(speed: number): void {
    useMat.setState({ speed });
    if (useMat.getState().state?.playing) this.play();
  }

  reset(): void {
    if (this.movedStarts) this.begin(false);
    else this.say({ do: "reset", seed: useMat.getState().seed });
  }

  /** Put a car elsewhere; `mat` where that is its new start. */
  move(car: number, pose: Pose, mat: Mat | null): void {
    this.say({ do: "move", car, ...pose });
    if (!mat || !this.told) return;
    this.told = { ...this.told, beginning: this.signOfBeginning(mat), mat };
    this.movedStarts = true;
  }

  private signOfBeginning(mat: Mat): string {
    const { image, profile } = this.program;
    return signOf(JSON.stringify([image, profile, beginning(mat)]));
  }

  private syncNow(): void {
    const { mat, rangeMm } = useMat.getState();
    if (!this.told) return;
    const wait = this.program.image === null ? this.patientUntil - Date.now() : 0;
    if (wait > 0) {
      this.timer = setTimeout(() => this.syncNow(), wait);
      return;
    }
    if (this.told.beginning !== this.signOfBeginning(mat)) {
      this.begin(this.asked || (useMat.getState().state?.playing ?? false));
    } else if (this.told.mat !== mat || this.told.rangeMm !== rangeMm) {
      useMat.setState({ problem: null });
      this.say({ do: "furnish", mat, range_mm: rangeMm });
      this.told = { ...this.told, mat, rangeMm };
    }
  }

  /** A world anew, which then goes on as the one before did. */
  private begin(playing: boolean): void {
    const { mat, seed, rangeMm } = useMat.getState();
    const { image, profile } = this.program;
    useMat.setState({ problem: null });
    this.say({ do: "set", image, mat, profile, seed, range_mm: rangeMm });
    this.told = { beginning: this.signOfBeginning(mat), mat, rangeMm };
    sessionStorage.setItem(KEPT_BEGINNING, this.told.beginning!);
    this.movedStarts = false;
    this.starts = null;
    if (playing) this.play();
  }

  /** Scrubbing asks for more moments than can be shown: only the newest wish of a short while is told. */
  seek(tMs: number | null): void {
    clearTimeout(this.seeking);
    this.seeking = setTimeout(() => this.say({ do: "seek", t_ms: tMs }), SEEK_MS);
  }

  watch(): void {
    this.say({ do: "watch", car: chosenCar() });
    this.tell();
  }

  private linked(link: Link): void {
    if (link !== "open") this.told = null;
    useMat.setState({ link, compiling: false });
  }

  private hear(answer: Answer): void {
    if (answer.is === "hello") this.greet(answer);
    if (answer.is === "state") this.hearState(answer);
    if (answer.is === "car" && answer.car === chosenCar()) useMat.setState({ details: answer });
    if (answer.is === "error") useMat.setState({ problem: answer, compiling: false });
    if (answer.is === "compiling") useMat.setState({ compiling: true });
  }

  private hearState(state: WorldState): void {
    const tMs = state.shown_ms ?? state.t_ms;
    if (state.playing) this.asked = false;
    useMat.setState({ state, tMs, seed: state.seed, ...(state.playing && { speed: state.speed }) });
  }

  private greet(hello: Hello): void {
    if (!this.told) {
      const kept = hello.resumed ? sessionStorage.getItem(KEPT_BEGINNING) : null;
      this.told = { beginning: kept, mat: null, rangeMm: null };
      this.patientUntil = hello.resumed ? Date.now() + PATIENCE_MS : 0;
      this.sync();
    }
    const car = chosenCar();
    if (car !== null && car >= hello.cars) useMat.setState({ chosen: null, details: null });
    else if (car !== null) this.watch();
    useMat.setState({ hello, compiling: false });
    this.onHello?.(hello);
  }

  private take(picture: Picture): void {
    if (picture.cars !== useMat.getState().hello?.cars) return;
    this.picture = picture;
    if (picture.tMs === 0 && !picture.past) this.starts = picture;
    this.events.take(picture);
    this.onPicture?.(picture);
    const running = runningBlocks(picture, this.program.words);
    if (!sameRunning(running, this.running)) this.onRunning?.(running);
    this.running = running;
    const wait = picture.past || picture.fresh ? 0 : this.toldAt + TOLD_EVERY_MS - performance.now();
    clearTimeout(this.telling);
    if (wait <= 0) this.tell();
    else this.telling = setTimeout(() => this.tell(), wait);
  }

  /** What the newest picture shows, for those who can't follow each; the last of a row is always told. */
  private tell(): void {
    const { picture } = this;
    if (!picture) return;
    this.toldAt = performance.now();
    const car = chosenCar();
    useMat.setState({ tMs: picture.tMs, past: picture.past, pose: car === null ? null : poseIn(picture, car) });
  }
}
