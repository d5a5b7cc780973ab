/** The connection to the cars, which is opened again whenever it is lost, and the keys and gamepads that steer them. */

import { create } from "zustand";
import { LastingStream, openSocket } from "../api/connection";
import type { Stream, StreamListeners } from "../api/service";
import type { Sentence } from "../generated/messages";
import type { CarTelemetry, ListedCar, RemoteAnswer, RemoteMessage } from "../generated/remote";
import { useSettings } from "../state/settings";
import { type Axes, asksToStop, DeadmanSwitch, gamepadAxes, isDrivingKey, keyAxes, PERIOD_MS } from "./input";

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

/** More than are ever under way at once. */
const MOST_UNANSWERED = 64;
// As motorcade/drive/stamps.py counts.
const STAMP_MS = 4;
const STAMPS = 2047;

export class Link {
  private readonly stream: LastingStream;
  private number = 0;
  private sentMs = new Map<number, number>();
  /** The car to join first; null for the first of the list. */
  private firstCar: string | null = null;

  constructor(
    open: (listeners: StreamListeners) => Stream,
    private readonly now: () => number,
  ) {
    this.stream = new LastingStream(open, {
      onOpen: () => undefined,
      onMessage: (data) => this.receive(JSON.parse(data as string) as RemoteAnswer),
      onClose: () => {
        useRemote.setState({ open: false, telemetry: {}, roundTripMs: null });
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
    if (cars.length === 0) return;
    const number = this.number + 1;
    if (!this.send({ do: "drive", cars, throttle, steering, number, stamp: this.stamp() })) return;
    this.number = number;
    this.sentMs.set(number, this.now());
    this.sentMs.delete(number - MOST_UNANSWERED);
  }

  /** A server finds positions that a stalled network delivers late by when they were sent. */
  private stamp(): number {
    return 1 + (Math.floor(this.now() / STAMP_MS) % STAMPS);
  }

  private send(message: RemoteMessage): boolean {
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
    if (clock !== null) this.send({ do: "sync", clock, number: this.number, stamp: this.stamp() });
  }

  private receiveHello(cars: ListedCar[]): void {
    const { joined } = useRemote.getState();
    useRemote.setState({ open: true, cars, problem: null });
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

/** The user's name in the name of a page, as `motorcade.server.remote.fleet.named_page` makes it; null for none. */
export function userOf(page: string | null): string | null {
  const end = page?.lastIndexOf(" · ") ?? -1;
  return page && end > 0 ? page.slice(0, end) : null;
}

/** The share of the highest speed that a page begins with. */
export const FIRST_LIMIT = 0.6;

const now = () => performance.now();

export const link = new Link((listeners) => openSocket(socketAddress(), listeners), now);
export const deadman = new DeadmanSwitch((axes) => link.drive(axes), now);

const keys = new Set<string>();

function holdKeys(): void {
  const axes = keyAxes(keys);
  if (axes) deadman.hold("keys", axes);
  else deadman.release("keys");
}

/** Whether a key belongs to the focused field. On a button the space bar stops the cars: Enter presses the button. */
const isForField = ({ target }: KeyboardEvent) => target instanceof Element && target.matches("input, select, summary");

function keyDown(event: KeyboardEvent): void {
  if (event.ctrlKey || event.metaKey || event.altKey || isForField(event)) return;
  if (event.code === "Space") {
    event.preventDefault();
    deadman.releaseAll();
    link.stopAll();
  } else if (isDrivingKey(event.code)) {
    event.preventDefault();
    keys.add(event.code);
    holdKeys();
  }
}

function keyUp(event: KeyboardEvent): void {
  if (keys.delete(event.code)) holdKeys();
  // Some browsers press a button when the space bar comes up.
  if (event.code === "Space" && !isForField(event)) event.preventDefault();
}

let stopWasPressed = false;

function pollGamepad(): void {
  // Browsers give gamepads to secure pages alone: those of this computer, and by HTTPS.
  const pads = "getGamepads" in navigator ? navigator.getGamepads() : [];
  const pad = pads.find((each) => each?.connected);
  const axes = pad && gamepadAxes(pad);
  if (axes) deadman.hold("gamepad", axes);
  else deadman.release("gamepad");
  const stop = pad ? asksToStop(pad) : false;
  if (stop && !stopWasPressed) link.stopAll();
  stopWasPressed = stop;
}

function releaseAll(): void {
  keys.clear();
  deadman.releaseAll();
}

/** Connect and follow keys and gamepads. A page that is hidden or without the focus holds nothing. To be called once. */
export function startDriving(): void {
  deadman.limit = FIRST_LIMIT;
  link.open(new URLSearchParams(location.search).get("car"));
  useRemote.subscribe(({ open }) => {
    if (!open) deadman.distrust();
  });
  window.addEventListener("keydown", keyDown);
  window.addEventListener("keyup", keyUp);
  window.addEventListener("blur", releaseAll);
  window.addEventListener("pagehide", releaseAll);
  document.addEventListener("visibilitychange", () => document.hidden && releaseAll());
  setInterval(() => {
    if (document.hidden) return;
    pollGamepad();
    deadman.tick();
  }, PERIOD_MS);
}
