/** The dead-man's handle: what is sent is what is held now, and what is let go stops. */

export interface Axes {
  /** -1 full speed back to 1 full speed ahead. */
  throttle: number;
  /** -1 full left to 1 full right. */
  steering: number;
}

export const STILL: Axes = { throttle: 0, steering: 0 };
export type Handle = "stick" | "keys" | "gamepad";
/** How often the stick is sent; a car stops by itself after some six of these. */
export const PERIOD_MS = 50;
/** A car that has stopped by itself wants to be told 'stand still' first, and to have time to notice. */
const ARMING_MS = 90;
/** So often 'stand still' is sent when all is let go, should one of them get lost. */
const FAREWELLS = 4;

export class Pilot {
  /** Share of the car's speed that a full stick means. */
  limit = 1;
  private held = new Map<Handle, Axes>();
  private begunMs = 0;
  private farewells = 0;

  constructor(
    private readonly send: (axes: Axes) => void,
    private readonly now: () => number,
  ) {}

  get isHeld(): boolean {
    return this.held.size > 0;
  }

  /** What is held last counts; the others wait beneath it. */
  hold(handle: Handle, axes: Axes): void {
    if (!this.isHeld) {
      this.begunMs = this.now();
      this.send(STILL);
    }
    if (!this.held.has(handle)) this.held.set(handle, axes);
    else this.held = new Map([...this.held].map(([name, old]) => [name, name === handle ? axes : old]));
  }

  letGo(handle: Handle): void {
    if (!this.held.delete(handle) || this.isHeld) return;
    this.farewells = FAREWELLS;
    this.tick();
  }

  letGoOfAll(): void {
    for (const handle of [...this.held.keys()]) this.letGo(handle);
  }

  /** Sends what is due; to be called every PERIOD_MS. */
  tick(): void {
    if (this.isHeld) {
      const axes = [...this.held.values()].at(-1)!;
      const armed = this.now() - this.begunMs >= ARMING_MS;
      this.send(armed ? { throttle: axes.throttle * this.limit, steering: axes.steering } : STILL);
    } else if (this.farewells > 0) {
      this.farewells -= 1;
      this.send(STILL);
    }
  }
}
