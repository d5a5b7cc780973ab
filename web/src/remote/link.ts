/** What the page sends to the cars and when, and their connection, which is opened again whenever it is lost. */

import { create } from "zustand";
import { LastingStream, openSocket } from "../api/connection";
import type { Stream, StreamListeners } from "../api/service";
import type { Sentence } from "../generated/messages";
import { type DeadmanEvent, FRESH_MS, LASTS_MS, NEXT, type DeadmanState, STAMP_STEP_MS, STAMP_STEPS, SWITCHES } from "../generated/driving";
import type { CarTelemetry, ListedCar, RemoteAnswer, RemoteMessage } from "../generated/remote";
import { useSettings } from "../state/settings";

export interface Axes {
  /** -1 full speed back to 1 full speed ahead. */
  throttle: number;
  /** -1 full left to 1 full right. */
  steering: number;
}

export const AT_REST: Axes = { throttle: 0, steering: 0 };

interface Remote {
  open: boolean;
  /** The first connection is neither open nor refused yet. */
  opening: boolean;
  /** This page's user has driven: before that, no state of a car is the user's fault. */
  hasDriven: boolean;
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
  opening: true,
  hasDriven: false,
  cars: [],
  joined: [],
  telemetry: {},
  roundTripMs: null,
  receivedAtMs: 0,
  problem: null,
}));

/** More than are ever under way at once. */
const MOST_UNANSWERED = 64;

/** Milliseconds of clocks that wrap at 2^30, as a car's. */
const TICKS_MASK = 2 ** 30 - 1;
const elapsedMs = (nowMs: number, thenMs: number) => Math.floor(nowMs - thenMs) & TICKS_MASK;

/** A server finds positions that a stalled network delivers late by when they were sent. */
export const stampAt = (nowMs: number) => 1 + (Math.floor(nowMs / STAMP_STEP_MS) % STAMP_STEPS);

/** What is switched beside the wheels: 0 or 1 by name. */
export type Switches = Record<string, number>;

/** Decide what is sent when, by the table of motorcade/drive/deadman.py. */
export class DeadmanSwitch {
  private state: DeadmanState = "idle";
  /** When something was first sent in this state: a car is armed by what is sent, not by what waits. */
  private sinceMs: number | null = null;
  private axes = AT_REST;
  private commandedMs = 0;
  /** What is switched, by name, and when that was commanded. */
  private switched = new Map<string, { value: number; atMs: number }>();

  /** Command these axes for the next FRESH_MS, and switches; one that was held and isn't named is switched off. */
  command(axes: Axes, nowMs: number, switches: Switches = {}): void {
    this.axes = axes;
    this.commandedMs = nowMs;
    this.lift(nowMs);
    for (const [name, value] of Object.entries(switches)) this.switched.set(name, { value, atMs: nowMs });
    this.take(axes.throttle === 0 ? "still" : "speed");
  }

  /** Command nothing any more. */
  release(nowMs: number): void {
    this.lift(nowMs);
    this.take("nothing");
  }

  /** Command nothing because of an order, such as the emergency stop; a stick that is held must be released. */
  order(): void {
    this.take(this.axes.throttle === 0 ? "order" : "lost");
  }

  /** Note that the connection is lost. */
  lose(): void {
    this.take(this.axes.throttle === 0 ? "again" : "lost");
  }

  /** The axes to send now; null for nothing. */
  next(nowMs: number): Axes | null {
    if (this.state !== "resting" && elapsedMs(nowMs, this.commandedMs) > FRESH_MS) this.take("nothing");
    if (this.sinceMs !== null && elapsedMs(nowMs, this.sinceMs) >= (LASTS_MS[this.state] ?? Infinity)) this.take("over");
    this.sinceMs ??= nowMs;
    if (this.state === "driving") return this.axes;
    if (this.state === "arming") return { ...AT_REST, steering: this.axes.steering };
    return this.state === "resting" ? AT_REST : null;
  }

  /** What to switch now, behind `next`: what was commanded in the last FRESH_MS. */
  switches(nowMs: number): Switches {
    if (this.state === "idle" || this.state === "locked") return {};
    const due = [...this.switched].filter(([, { atMs }]) => elapsedMs(nowMs, atMs) <= FRESH_MS);
    return Object.fromEntries(due.map(([name, { value }]) => [name, value]));
  }

  /** Switch off what is held. */
  private lift(nowMs: number): void {
    for (const { name, held } of SWITCHES) {
      if (held && this.switched.get(name)?.value) this.switched.set(name, { value: 0, atMs: nowMs });
    }
  }

  private take(event: DeadmanEvent): void {
    const following = NEXT[this.state][event];
    if (following === undefined) return;
    this.state = following;
    this.sinceMs = null;
  }
}

type InputName = "stick" | "keys" | "gamepad";

/** What the page's inputs hold, and the dead-man switch that sends it. */
export class HeldInputs {
  /** The share of the car's highest speed that a full stick means. */
  limit = 1;
  readonly deadman = new DeadmanSwitch();
  private held = new Map<InputName, Axes>();
  /** The switches that are held. */
  private pressed = new Set<string>();

  constructor(
    private readonly send: (axes: Axes, switches: Switches) => void,
    private readonly now: () => number,
  ) {}

  /** Note what an input holds now. The input that was taken last counts; the others wait. */
  hold(input: InputName, axes: Axes): void {
    const isFirst = !this.holdsAnything();
    // A key that a map has keeps its place.
    this.held.set(input, axes);
    if (isFirst) this.tick();
  }

  release(input: InputName): void {
    if (this.held.delete(input) && this.held.size === 0) this.rest();
  }

  /** Hold a switch, such as a horn. A car without a driver is driven then, standing still. */
  press(name: string): void {
    this.pressed.add(name);
    this.tick();
  }

  lift(name: string): void {
    if (this.pressed.delete(name)) this.rest();
  }

  /** Switch something on or off that stays so. */
  set(name: string, value: number): void {
    this.command({ [name]: value });
    this.rest();
  }

  releaseAll(): void {
    this.held.clear();
    this.pressed.clear();
    this.rest();
  }

  /** Send what is due. To be called every PERIOD_MS. */
  tick(): void {
    if (this.holdsAnything()) this.command({});
    const due = this.deadman.next(this.now());
    if (due) this.send(due, this.deadman.switches(this.now()));
  }

  private holdsAnything(): boolean {
    return this.held.size > 0 || this.pressed.size > 0;
  }

  private command(switches: Switches): void {
    const { throttle, steering } = [...this.held.values()].at(-1) ?? AT_REST;
    const pressed = Object.fromEntries([...this.pressed].map((name) => [name, 1]));
    this.deadman.command({ throttle: throttle * this.limit, steering }, this.now(), { ...pressed, ...switches });
  }

  /** Send at once what is still held; nothing more where nothing is. */
  private rest(): void {
    if (!this.holdsAnything()) this.deadman.release(this.now());
    this.tick();
  }
}

export class RemoteLink {
  private readonly stream: LastingStream<RemoteAnswer>;
  private number = 0;
  private sentMs = new Map<number, number>();
  /** The car to join first; null for the first of the list. */
  private firstCar: string | null = null;

  constructor(
    open: (listeners: StreamListeners) => Stream,
    private readonly now: () => number,
  ) {
    this.stream = new LastingStream(open, {
      onAnswer: (answer) => this.receive(answer),
      onClose: () => {
        useRemote.setState({ open: false, opening: false, telemetry: {}, roundTripMs: null });
        this.sentMs.clear();
      },
    });
  }

  /** Connect, again and again; join `firstCar`, or the first car of the list. */
  open(firstCar: string | null): void {
    this.firstCar = firstCar;
    this.stream.reopen();
  }

  /** Connect again, under another name. */
  reconnect(): void {
    this.stream.lose();
  }

  join(car: string): void {
    useRemote.setState(({ joined }) => ({ joined: joined.includes(car) ? joined : [...joined, car] }));
    this.send({ do: "join", car });
  }

  leave(car: string): void {
    useRemote.setState(({ joined }) => ({ joined: joined.filter((each) => each !== car) }));
    this.send({ do: "leave", car });
  }

  stopAll(): void {
    this.send({ do: "stop", cars: useRemote.getState().joined });
  }

  drive({ throttle, steering }: Axes, switches: Switches = {}): void {
    const cars = useRemote.getState().joined;
    if (cars.length === 0) return;
    const number = this.number + 1;
    const held = Object.keys(switches).length > 0 && { switches };
    if (!this.send({ do: "drive", cars, throttle, steering, ...held, number, stamp: stampAt(this.now()) })) return;
    this.number = number;
    if (number === 1) useRemote.setState({ hasDriven: true });
    this.sentMs.set(number, this.now());
    this.sentMs.delete(number - MOST_UNANSWERED);
  }

  /** Send a message; false while the connection is lost. */
  send(message: RemoteMessage): boolean {
    return this.stream.send(message);
  }

  private receive(message: RemoteAnswer): void {
    useRemote.setState({ receivedAtMs: this.now() });
    if (message.is === "hello") this.receiveHello(message.cars);
    else if (message.is === "telemetry") this.receiveTelemetry(message.cars, message.clock);
    else if (message.is === "error") useRemote.setState({ problem: message.sentence });
    else {
      const sentMs = this.sentMs.get(message.number);
      if (sentMs !== undefined) useRemote.setState({ roundTripMs: this.now() - sentMs });
      this.sentMs.delete(message.number);
    }
  }

  /** After a long rest a server believes the page's stamps only when the page has answered its clock. */
  private receiveTelemetry(telemetry: Record<string, CarTelemetry>, clock: number | null): void {
    useRemote.setState({ telemetry });
    if (clock !== null) this.send({ do: "sync", clock, number: this.number, stamp: stampAt(this.now()) });
  }

  private receiveHello(cars: ListedCar[]): void {
    const { joined } = useRemote.getState();
    useRemote.setState({ open: true, opening: false, cars, problem: null });
    const there = cars.map(({ car }) => car);
    const first = joined.length > 0 ? [] : there.filter((car) => car === this.firstCar || (!this.firstCar && car === there[0]));
    this.firstCar = null;
    useRemote.setState({ joined: [] });
    for (const car of [...joined.filter((car) => there.includes(car)), ...first]) this.join(car);
  }
}

/** The address of a path of the server's, for a car, in the studio's world that the page's own address names. */
export function address(path: string, car?: string): string {
  const session = new URLSearchParams(location.search).get("session");
  const query = new URLSearchParams({ ...(session && { session }), ...(car && { car }) });
  return query.size > 0 ? `${path}?${query}` : path;
}

/** The address of the connection, with the user's name, if there is one. */
export function socketAddress(): string {
  const url = new URL(address("/drive/ws"), location.origin);
  const { userName } = useSettings.getState();
  if (userName) url.searchParams.set("name", userName);
  return url.href;
}

/** The user's name in the name of a page, as `motorcade.server.fleet.named_page` makes it; null for none. */
export function userOf(page: string | null): string | null {
  const end = page?.lastIndexOf(" · ") ?? -1;
  return page && end > 0 ? page.slice(0, end) : null;
}

/** The share of the highest speed that a page begins with. */
export const FIRST_LIMIT = 0.6;

const now = () => performance.now();

export const link = new RemoteLink((listeners) => openSocket(socketAddress(), listeners), now);
export const inputs = new HeldInputs((axes, switches) => link.drive(axes, switches), now);

/** The emergency stop of all cars; what is held has to be released before it drives again. */
export function stopAll(): void {
  inputs.deadman.order();
  link.stopAll();
}
