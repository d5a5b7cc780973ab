/** The connection to the cars: it comes back by itself, and knows how old its telemetry is. */

import { create } from "zustand";
import type { Sentence } from "../generated/messages";
import type { CarTelemetry, ListedCar, RemoteAnswer, RemoteMessage } from "../generated/remote";
import type { Axes } from "./input";

interface Remote {
  open: boolean;
  cars: ListedCar[];
  /** The cars that this page has joined, in that order; one stick drives them all. */
  joined: string[];
  telemetry: Record<string, CarTelemetry>;
  /** From sending a stick to the answer that it was received. */
  roundTripMs: number | null;
  /** When the last message of the server came. */
  receivedAtMs: number;
  problem: Sentence | null;
}

export const useRemote = create<Remote>(() => ({
  open: false,
  cars: [],
  joined: [],
  telemetry: {},
  roundTripMs: null,
  receivedAtMs: 0,
  problem: null,
}));

const FIRST_WAIT_MS = 300;
const LONGEST_WAIT_MS = 4000;
/** More than are ever under way at once. */
const MOST_UNANSWERED = 64;

type Socket = Pick<WebSocket, "send" | "close" | "readyState"> & EventTarget;

export class Link {
  private socket: Socket | null = null;
  private number = 0;
  private sentMs = new Map<number, number>();
  private waitMs = FIRST_WAIT_MS;
  /** The car to join first; null for the first of the list. */
  private firstCar: string | null = null;

  constructor(
    private readonly connect: () => Socket,
    private readonly now: () => number,
  ) {}

  /** Connect, again and again; join `firstCar`, or the first car of the list. */
  open(firstCar: string | null): void {
    this.firstCar = firstCar;
    this.connectAgain();
  }

  private connectAgain(): void {
    const socket = this.connect();
    this.socket = socket;
    socket.addEventListener("message", (event) => {
      this.receive(JSON.parse((event as MessageEvent<string>).data) as RemoteAnswer);
    });
    socket.addEventListener("close", () => {
      useRemote.setState({ open: false, telemetry: {}, roundTripMs: null });
      this.sentMs.clear();
      setTimeout(() => this.connectAgain(), this.waitMs);
      this.waitMs = Math.min(this.waitMs * 2, LONGEST_WAIT_MS);
    });
  }

  join(car: string): void {
    useRemote.setState(({ joined }) => ({ joined: joined.includes(car) ? joined : [...joined, car] }));
    this.send({ do: "join", car });
  }

  leave(car: string): void {
    useRemote.setState(({ joined }) => ({ joined: joined.filter((each) => each !== car) }));
    this.send({ do: "leave", car });
  }

  /** Request something about one car. */
  request(what: "request" | "release" | "clear" | "resume", car: string): void {
    this.send({ do: what, car });
  }

  start(): void {
    this.send({ do: "start" });
  }

  stopAll(): void {
    this.send({ do: "stop", cars: useRemote.getState().joined });
  }

  drive({ throttle, steering }: Axes): void {
    const cars = useRemote.getState().joined;
    if (cars.length === 0 || this.socket?.readyState !== WebSocket.OPEN) return;
    this.number += 1;
    this.sentMs.set(this.number, this.now());
    this.sentMs.delete(this.number - MOST_UNANSWERED);
    this.send({ do: "drive", cars, throttle, steering, number: this.number });
  }

  private send(message: RemoteMessage): void {
    if (this.socket?.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(message));
  }

  private receive(message: RemoteAnswer): void {
    useRemote.setState({ receivedAtMs: this.now() });
    if (message.is === "hello") this.receiveHello(message.cars);
    else if (message.is === "telemetry") useRemote.setState({ telemetry: message.cars });
    else if (message.is === "error") useRemote.setState({ problem: message.sentence });
    else {
      const sentMs = this.sentMs.get(message.number);
      if (sentMs !== undefined) useRemote.setState({ roundTripMs: this.now() - sentMs });
      this.sentMs.delete(message.number);
    }
  }

  private receiveHello(cars: ListedCar[]): void {
    const { joined } = useRemote.getState();
    this.waitMs = FIRST_WAIT_MS;
    useRemote.setState({ open: true, cars, problem: null });
    const there = cars.map(({ car }) => car);
    const first = joined.length > 0 ? [] : there.filter((car) => car === this.firstCar || (!this.firstCar && car === there[0]));
    this.firstCar = null;
    useRemote.setState({ joined: [] });
    for (const car of [...joined.filter((car) => there.includes(car)), ...first]) this.join(car);
  }
}
