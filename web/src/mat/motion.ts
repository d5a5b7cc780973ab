/** Where the cars are between two pictures of the world. */

import type { Picture } from "../api/world";

/** A car that moves farther from one picture to the next was moved by the user: none drives so fast. */
const MOST_DRIVEN_M = 0.5;

export interface Drawn {
  x: Float32Array;
  y: Float32Array;
  heading: Float32Array;
}
function placesOf(cars: number): Drawn {
  const make = () => new Float32Array(cars);
  return { x: make(), y: make(), heading: make() };
}

export class Motion {
  private before: Picture | null = null;
  picture: Picture | null = null;
  private arrivedAt = 0;
  private interval = 33;
  drawn: Drawn = placesOf(0);

  take(picture: Picture, atMs: number): void {
    const continues = this.picture?.cars === picture.cars && !picture.fresh && !picture.past && !this.picture.past;
    this.before = continues ? this.picture : null;
    // A long pause between two pictures must not slow the next drawing down.
    if (continues) this.interval += (Math.min(100, Math.max(16, atMs - this.arrivedAt)) - this.interval) / 4;
    this.picture = picture;
    this.arrivedAt = atMs;
    if (this.drawn.x.length !== picture.cars) {
      this.drawn = placesOf(picture.cars);
    }
  }

  /** Forget the pictures: there are other cars now. */
  forget(): void {
    this.before = this.picture = null;
    this.drawn = placesOf(0);
  }

  /** Compute `drawn` for this moment; true if a later moment would differ. */
  advance(atMs: number): boolean {
    if (!this.picture) return false;
    const share = this.before ? Math.min(1, (atMs - this.arrivedAt) / this.interval) : 1;
    between(this.before ?? this.picture, this.picture, share, this.drawn);
    return share < 1;
  }
}

function between(a: Picture, b: Picture, share: number, drawn: Drawn): void {
  for (let k = 0; k < b.cars; k++) {
    const dx = b.x[k]! - a.x[k]!;
    const dy = b.y[k]! - a.y[k]!;
    const part = Math.abs(dx) > MOST_DRIVEN_M || Math.abs(dy) > MOST_DRIVEN_M ? 1 : share;
    drawn.x[k] = a.x[k]! + dx * part;
    drawn.y[k] = a.y[k]! + dy * part;
    drawn.heading[k] = a.heading[k]! + shortestTurn(b.heading[k]! - a.heading[k]!) * part;
  }
}

export function shortestTurn(radians: number): number {
  return radians - 2 * Math.PI * Math.round(radians / (2 * Math.PI));
}
