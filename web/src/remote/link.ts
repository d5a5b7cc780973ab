/** The connection to the cars: it comes back by itself, and knows how old what it tells is. */

import { create } from "zustand";
import type { Axes } from "./pilot";

export interface ListedCar {
  car: string;
  leads: boolean | null;
  sees: boolean;
  /** What its owner calls it, where it has a name. */
  name: string | null;
}

export type Sentence = Record<string, string>;

export interface Told {
  state: "ready" | "standing" | "moving" | "failsafe" | "stopped" | "program" | "away";
  angle_deg: number;
  direction: number;
  speed: number;
  driver: string | null;
  wanted_by: string | null;
  battery_mv: number | null;
  last_fault: string;
  /** Its world stands still. */
  paused: boolean;
  /** Since the server last heard of it. */
  silent_ms: number;
  /** Why it is away, where that is known. */
  why: Sentence | null;
  you: { drives: boolean; waits: boolean };
}

type Message =
  | { is: "hello"; cars: ListedCar[] }
  | { is: "telemetry"; cars: Record<string, Told> }
  | { is: "heard"; number: number }
  | { is: "error"; sentence: Sentence };

interface Remote {
  open: boolean;
  listed: ListedCar[];
  /** The cars at which we sit, in the order in which we came. */
  seats: string[];
  told: Record<string, Told>;
  /** From a stick sent to the answer that it was heard. */
  roundTripMs: number | null;
  /** When the car was last heard of. */
  heardMs: number;
  problem: Sentence | null;
}

export const useRemote = create<Remote>(() => ({
  open: false,
  listed: [],
  seats: [],
  told: {},
  roundTripMs: null,
  heardMs: 0,
  problem: null,
}));

const FIRST_WAIT_MS = 300;
const LONGEST_WAIT_MS = 4000;
/** Enough for those under way. */
const MOST_UNANSWERED = 64;

type Socket = Pick<WebSocket, "send" | "close" | "readyState"> & EventTarget;

export class Link {
  private socket: Socket | null = null;
  private number = 0;
  private sentMs = new Map<number, number>();
  private waitMs = FIRST_WAIT_MS;
  /** The car to sit at first. */
  private wished: string | null;

  constructor(
    private readonly connect: () => Socket,
    private readonly now: () => number,
    wished: string | null,
  ) {
    this.wished = wished;
  }

  begin(): void {
    const socket = this.connect();
    this.socket = socket;
    socket.addEventListener("message", (event) => {
      this.take(JSON.parse((event as MessageEvent<string>).data) as Message);
    });
    socket.addEventListener("close", () => {
      useRemote.setState({ open: false, told: {}, roundTripMs: null });
      this.sentMs.clear();
      setTimeout(() => this.begin(), this.waitMs);
      this.waitMs = Math.min(this.waitMs * 2, LONGEST_WAIT_MS);
    });
  }

  sit(car: string): void {
    useRemote.setState(({ seats }) => ({ seats: seats.includes(car) ? seats : [...seats, car] }));
    this.say({ do: "join", car });
  }

  leave(car: string): void {
    useRemote.setState(({ seats }) => ({ seats: seats.filter((seat) => seat !== car) }));
    this.say({ do: "leave", car });
  }

  /** Something about one car. */
  ask(what: "request" | "release" | "clear" | "resume", car: string): void {
    this.say({ do: what, car });
  }

  start(): void {
    this.say({ do: "start" });
  }

  stopAll(): void {
    this.say({ do: "stop", cars: useRemote.getState().seats });
  }

  drive({ throttle, steering }: Axes): void {
    const cars = useRemote.getState().seats;
    if (cars.length === 0 || this.socket?.readyState !== WebSocket.OPEN) return;
    this.number += 1;
    this.sentMs.set(this.number, this.now());
    this.sentMs.delete(this.number - MOST_UNANSWERED);
    this.say({ do: "drive", cars, throttle, steering, number: this.number });
  }

  private say(message: Record<string, unknown>): void {
    if (this.socket?.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(message));
  }

  private take(message: Message): void {
    useRemote.setState({ heardMs: this.now() });
    if (message.is === "hello") this.greet(message.cars);
    else if (message.is === "telemetry") useRemote.setState({ told: message.cars });
    else if (message.is === "error") useRemote.setState({ problem: message.sentence });
    else {
      const sentMs = this.sentMs.get(message.number);
      if (sentMs !== undefined) useRemote.setState({ roundTripMs: this.now() - sentMs });
      this.sentMs.delete(message.number);
    }
  }

  private greet(listed: ListedCar[]): void {
    const { seats } = useRemote.getState();
    this.waitMs = FIRST_WAIT_MS;
    useRemote.setState({ open: true, listed, problem: null });
    const there = listed.map(({ car }) => car);
    const first = seats.length > 0 ? [] : there.filter((car) => car === this.wished || (!this.wished && car === there[0]));
    this.wished = null;
    useRemote.setState({ seats: [] });
    for (const car of [...seats.filter((seat) => there.includes(seat)), ...first]) this.sit(car);
  }
}
