/**
 * Which words cars missed for good. A frame that is lost says little: others repeat its word, and the car hears one of
 * them. A word is missed where a car lost a frame of it and heard none within WAIT_MS before and after. The bits of a
 * damaged frame don't say which word it was: there, a car that heard anything meanwhile missed nothing.
 */

import { type CarEvent, eventsOf, LATELY_S, type LossReason, type Picture } from "../api/world";

const DAMAGED: readonly LossReason[] = ["parity", "reserved", "check"];
const WAIT_MS = 1500;
/** More open questions than these are not kept: nobody could look at so many cars. */
const MOST_OPEN = 20_000;

/** A car that missed a word for good. */
export interface Miss {
  car: number;
  collided: boolean;
}

/** A word, or null for any, at a car. A car sets the lowest bit, which is the parity, when it sends. */
const keyOf = (car: number, word: number | null) => `${car} ${word === null ? "any" : word >>> 1}`;

export class MissedWords {
  /** How many were missed in the last LATELY_S. */
  count = 0;
  /** Losses after which the word may still be heard, by car and word; the oldest first. */
  private open = new Map<string, { tMs: number; miss: Miss }>();
  private heardMs = new Map<string, number>();
  private missedMs: number[] = [];

  /** Take a picture's events; returns what has turned out to be missed. */
  take(picture: Picture): Miss[] {
    const { tMs, past, fresh } = picture;
    if (past) return [];
    if (fresh) this.forget();
    for (const event of eventsOf(picture)) {
      if (event.kind === "heard") this.hear(event);
      if (event.kind === "lost") this.lose(event);
    }
    const missed: Miss[] = [];
    for (const [key, { tMs: lostMs, miss }] of this.open) {
      if (tMs - lostMs <= WAIT_MS) break;
      this.open.delete(key);
      this.missedMs.push(tMs);
      missed.push(miss);
    }
    if (this.heardMs.size > MOST_OPEN) this.heardMs.clear();
    this.missedMs = this.missedMs.filter((at) => tMs - at <= LATELY_S * 1000);
    this.count = this.missedMs.length;
    return missed;
  }

  private hear({ car, word, tMs }: CarEvent): void {
    for (const key of [keyOf(car, word), keyOf(car, null)]) {
      this.heardMs.set(key, tMs);
      this.open.delete(key);
    }
  }

  private lose({ car, word, tMs, why }: CarEvent): void {
    const key = keyOf(car, DAMAGED.includes(why) ? null : word);
    const isHeard = tMs - (this.heardMs.get(key) ?? -Infinity) <= WAIT_MS;
    if (isHeard || this.open.has(key) || this.open.size >= MOST_OPEN) return;
    this.open.set(key, { tMs, miss: { car, collided: why === "collision" } });
  }

  private forget(): void {
    this.open.clear();
    this.heardMs.clear();
    this.missedMs = [];
  }
}
