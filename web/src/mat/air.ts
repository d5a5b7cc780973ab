/** What is in the air: the rings of frames that go out, and how far infrared reaches. Lengths are metres. */

import { eventsOf, Flag, type Picture } from "../api/world";
import type { MatTheme } from "./colours";
import type { Drawn } from "./motion";

const RING_MS = 600;
/** More rings would hide the cars, and be slow without a graphics processor. */
const MOST_RINGS = 60;
const MOST_RANGES = 12;
const SENDER_M = 0.16;

/** A circle in the air, filled with so much of its colour. */
export interface Ring {
  x: number;
  y: number;
  radiusM: number;
  widthPx: number;
  colour: string;
  alpha: number;
  fill: number;
}

export class Air {
  chosen: number | null = null;
  shown = true;
  rangeM = 1;
  private sent: { car: number; begunAt: number }[] = [];
  private leads: readonly number[] = [];
  private senders: number[] = [];

  constructor(private readonly still: () => boolean) {}

  setCars(leads: readonly number[]): void {
    this.leads = leads;
    this.sent = [];
  }

  /** Take a picture's events; `onHeard` is told which cars heard a frame. */
  take(picture: Picture, atMs: number, onHeard: (car: number) => void): void {
    for (const { kind, car } of eventsOf(picture)) {
      if (kind === "frame" && this.shown && !this.still()) this.begin(car, atMs);
      if (kind === "heard") onHeard(car);
    }
    this.senders = [];
    if (!this.still()) return;
    picture.flags.forEach((flags, car) => flags & Flag.sends && this.senders.push(car));
  }

  private begin(car: number, atMs: number): void {
    if (this.sent.length >= MOST_RINGS) this.sent.shift();
    this.sent.push({ car, begunAt: atMs });
  }

  /** The rings of frames that go out at a moment; none is left where nothing in the air changes. */
  waves({ x, y }: Drawn, atMs: number, { ring }: MatTheme): Ring[] {
    this.sent = this.sent.filter(({ car, begunAt }) => atMs - begunAt <= RING_MS && car < x.length);
    return this.sent.map(({ car, begunAt }) => {
      const age = (atMs - begunAt) / RING_MS;
      // Those who pass words on stay behind the leader's.
      const [strong, far] = this.leads.includes(car) ? [0.8, 1] : [0.4, 0.4];
      const radiusM = this.rangeM * far * (0.08 + 0.92 * age);
      return { x: x[car]!, y: y[car]!, radiusM, widthPx: 1 + 3 * far * (1 - age), colour: ring, alpha: strong * (1 - age), fill: 0 };
    });
  }

  /** How far infrared reaches around leaders and the chosen car, and, where nothing may move, who sends. */
  ranges({ x, y }: Drawn, { range, ring }: MatTheme): Ring[] {
    if (!this.shown) return [];
    const around = new Set(this.leads.length <= MOST_RANGES ? this.leads : []);
    if (this.chosen !== null) around.add(this.chosen);
    const isThere = (car: number) => car < x.length;
    const reach = { radiusM: this.rangeM, widthPx: 1.5, colour: range, alpha: 0.4, fill: 0.05 };
    const sending = { radiusM: Math.min(this.rangeM, SENDER_M), widthPx: 2, colour: ring, alpha: 1, fill: 0 };
    return [
      ...[...around].filter(isThere).map((car) => ({ x: x[car]!, y: y[car]!, ...reach })),
      ...this.senders.filter(isThere).map((car) => ({ x: x[car]!, y: y[car]!, ...sending })),
    ];
  }
}
