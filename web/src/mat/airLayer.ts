/** What is in the air: the rings of frames that go out, and how far infrared reaches. */

import { Container, Graphics } from "pixi.js";
import { EVENT_COLUMNS, EventColumn, Flag, KINDS, LOSS_REASONS, type Picture } from "../api/world";
import type { Drawn } from "./carLayer";
import type { MatTheme } from "./colours";

const FRAME = KINDS.indexOf("frame");
const HEARD = KINDS.indexOf("heard");
const LOST = KINDS.indexOf("lost");
const COLLISION = LOSS_REASONS.indexOf("collision");
const RING_MS = 600;
/** More rings would hide the cars, and be slow without a graphics processor. */
const MOST_RINGS = 60;
const MOST_RANGES = 12;

interface Ring {
  car: number;
  begunAt: number;
}

/** A ring in the air at a moment; lengths are millimetres. */
interface Wave {
  x: number;
  y: number;
  radiusMm: number;
  widthPx: number;
  alpha: number;
}

interface FrameListeners {
  onLost: (car: number, collided: boolean) => void;
  onHeard: (car: number) => void;
}

export class AirLayer {
  readonly view = new Container();
  private readonly ranges = new Graphics();
  private readonly rippling = new Graphics();
  private rings: Ring[] = [];
  private rangeMm = 1000;
  private leads: readonly number[] = [];
  private senders: number[] = [];
  chosen: number | null = null;
  shown = true;

  constructor(
    private theme: MatTheme,
    private readonly still: () => boolean,
  ) {
    this.view.addChild(this.ranges, this.rippling);
  }

  setTheme(theme: MatTheme): void {
    this.theme = theme;
  }

  setCars(leads: readonly number[]): void {
    this.leads = leads;
    this.rings = [];
  }

  setRange(metres: number): void {
    this.rangeMm = metres * 1000;
  }

  take(picture: Picture, atMs: number, { onLost, onHeard }: FrameListeners): void {
    const { events } = picture;
    for (let at = 0; at < events.length; at += EVENT_COLUMNS) {
      const kind = events[at + EventColumn.kind]!;
      const car = events[at + EventColumn.car]!;
      if ((kind & 255) === FRAME && this.shown && !this.still()) this.begin(car, atMs);
      else if ((kind & 255) === HEARD) onHeard(car);
      else if ((kind & 255) === LOST) onLost(car, ((kind >> 8) & 255) === COLLISION);
    }
    this.senders = [];
    if (!this.still()) return;
    picture.flags.forEach((flags, car) => flags & Flag.sends && this.senders.push(car));
  }

  private begin(car: number, atMs: number): void {
    if (this.rings.length >= MOST_RINGS) this.rings.shift();
    this.rings.push({ car, begunAt: atMs });
  }

  /** The rings as they are at a moment. */
  waves(drawn: Drawn, atMs: number): Wave[] {
    return this.rings.map(({ car, begunAt }) => {
      const age = Math.min(1, (atMs - begunAt) / RING_MS);
      // Those who pass words on stay behind the leader's.
      const [strong, far] = this.leads.includes(car) ? [0.8, 1] : [0.4, 0.4];
      return {
        x: drawn.x[car]! * 1000,
        y: drawn.y[car]! * 1000,
        radiusMm: this.rangeMm * far * (0.08 + 0.92 * age),
        widthPx: 1 + 3 * far * (1 - age),
        alpha: strong * (1 - age),
      };
    });
  }

  /** Draw a moment; true while a ring is still growing. */
  draw(drawn: Drawn, scale: number, atMs: number): boolean {
    if (this.rings[0] && atMs - this.rings[0].begunAt > RING_MS) this.rings = this.rings.filter(({ begunAt }) => atMs - begunAt <= RING_MS);
    this.rippling.clear();
    for (const { x, y, radiusMm, widthPx, alpha } of this.waves(drawn, atMs)) {
      this.rippling.circle(x, y, radiusMm).stroke({ width: widthPx / scale, color: this.theme.ring, alpha });
    }
    this.drawRanges(drawn, scale);
    return this.rings.length > 0;
  }

  private drawRanges(drawn: Drawn, scale: number): void {
    this.ranges.clear();
    if (!this.shown) return;
    const around = this.leads.length <= MOST_RANGES ? new Set(this.leads) : new Set<number>();
    if (this.chosen !== null) around.add(this.chosen);
    for (const car of around) {
      if (car >= drawn.x.length) continue;
      this.ranges.circle(drawn.x[car]! * 1000, drawn.y[car]! * 1000, this.rangeMm);
    }
    if (around.size) this.ranges.fill({ color: this.theme.range, alpha: 0.05 });
    if (around.size) this.ranges.stroke({ width: 1.5 / scale, color: this.theme.range, alpha: 0.4 });
    for (const car of this.senders) {
      const radius = Math.min(this.rangeMm, 160);
      this.ranges.circle(drawn.x[car]! * 1000, drawn.y[car]! * 1000, radius);
    }
    if (this.senders.length) this.ranges.stroke({ width: 2 / scale, color: this.theme.ring });
  }
}
