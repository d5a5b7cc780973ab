/**
 * Which words cars missed for good. A frame that is lost says little: others repeat its word, and the car hears one of
 * them. A word is missed where a car lost a frame of it and heard none within WAIT_MS before and after. The bits of a
 * damaged frame don't say which word it was: there, a car that heard anything meanwhile missed nothing.
 */

import { EVENT_COLUMNS, EventColumn, KINDS, LATELY_S, LOSS_REASONS, type Picture } from "../api/world";

const HEARD = KINDS.indexOf("heard");
const LOST = KINDS.indexOf("lost");
const COLLISION = LOSS_REASONS.indexOf("collision");
const DAMAGED = (["parity", "reserved", "check"] as const).map((why) => LOSS_REASONS.indexOf(why));
const ANY_WORD = "any";
const WAIT_MS = 1500;
/** More open questions than these are not kept: nobody could look at so many cars. */
const MOST_OPEN = 20_000;

/** A car that missed a word for good. */
export interface Miss {
  car: number;
  collided: boolean;
}

export class MissedWords {
  /** How many were missed in the last LATELY_S. */
  count = 0;
  /** Losses after which the word may still be heard, by car and word; the oldest first. */
  private open = new Map<string, { tMs: number; miss: Miss }>();
  private heardMs = new Map<string, number>();
  private missedMs: number[] = [];

  /** Take a picture's events; returns what has turned out to be missed. */
  take({ events, tMs, past, fresh }: Picture): Miss[] {
    if (past) return [];
    if (fresh) this.forget();
    for (let at = 0; at < events.length; at += EVENT_COLUMNS) {
      const kind = events[at + EventColumn.kind]!;
      const isLost = (kind & 255) === LOST;
      if (!isLost && (kind & 255) !== HEARD) continue;
      const car = events[at + EventColumn.car]!;
      const eventMs = events[at + EventColumn.tMs]!;
      // A car sets the lowest bit, which is the parity, when it sends.
      const word = events[at + EventColumn.word]! >>> 1;
      if (!isLost) {
        for (const heard of [`${car} ${word}`, `${car} ${ANY_WORD}`]) {
          this.heardMs.set(heard, eventMs);
          this.open.delete(heard);
        }
        continue;
      }
      const key = `${car} ${DAMAGED.includes(kind >> 8) ? ANY_WORD : word}`;
      if (eventMs - (this.heardMs.get(key) ?? -Infinity) > WAIT_MS && !this.open.has(key) && this.open.size < MOST_OPEN) {
        this.open.set(key, { tMs: eventMs, miss: { car, collided: kind >> 8 === COLLISION } });
      }
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

  private forget(): void {
    this.open.clear();
    this.heardMs.clear();
    this.missedMs = [];
  }
}
