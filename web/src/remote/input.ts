/** The inputs that steer cars, as axes; null where nothing is held. A dead-man switch sends what is held. */

export interface Axes {
  /** -1 full speed back to 1 full speed ahead. */
  throttle: number;
  /** -1 full left to 1 full right. */
  steering: number;
}

export const AT_REST: Axes = { throttle: 0, steering: 0 };
export type InputName = "stick" | "keys" | "gamepad";
/** How often the stick is sent; a car stops by itself after about six of these. */
export const PERIOD_MS = 50;
/** A car that has stopped by itself accepts a stick at rest first, and needs this time to receive it. */
const ARMING_MS = 90;
/** How often a stick at rest is sent after a release, in case one message is lost. */
const REST_MESSAGES = 4;

/** Send the axes that are held now; a release stops the cars at once. */
export class DeadmanSwitch {
  /** The share of the car's highest speed that a full stick means. */
  limit = 1;
  private held = new Map<InputName, Axes>();
  private heldSinceMs = 0;
  private restsToSend = 0;
  private distrusted = false;

  constructor(
    private readonly send: (axes: Axes) => void,
    private readonly now: () => number,
  ) {}

  get isHeld(): boolean {
    return this.held.size > 0;
  }

  /** Note what an input holds now. The input that was taken last counts; the others wait. */
  hold(input: InputName, axes: Axes): void {
    if (!this.isHeld) {
      this.heldSinceMs = this.now();
      this.send(AT_REST);
    }
    if (!this.held.has(input)) this.held.set(input, axes);
    else this.held = new Map([...this.held].map(([name, old]) => [name, name === input ? axes : old]));
  }

  release(input: InputName): void {
    if (!this.held.delete(input) || this.isHeld) return;
    this.distrusted = false;
    this.restsToSend = REST_MESSAGES;
    this.tick();
  }

  releaseAll(): void {
    for (const input of [...this.held.keys()]) this.release(input);
  }

  /** Send nothing more of what is held now: it was meant for a connection that is lost. */
  distrust(): void {
    this.distrusted = this.isHeld;
  }

  /** Send what is due. To be called every PERIOD_MS. */
  tick(): void {
    if (this.distrusted) return;
    if (this.isHeld) {
      const axes = [...this.held.values()].at(-1)!;
      const armed = this.now() - this.heldSinceMs >= ARMING_MS;
      this.send(armed ? { throttle: axes.throttle * this.limit, steering: axes.steering } : AT_REST);
    } else if (this.restsToSend > 0) {
      this.restsToSend -= 1;
      this.send(AT_REST);
    }
  }
}

const clamp = (value: number) => Math.min(1, Math.max(-1, value));

/** A finger's distance right of and below the pad's middle, 1 being the pad's reach. */
export function fingerAxes(right: number, below: number): Axes {
  return { throttle: clamp(-below), steering: clamp(right) };
}

const THROTTLE: Record<string, number> = { ArrowUp: 1, KeyW: 1, ArrowDown: -1, KeyS: -1 };
const STEERING: Record<string, number> = { ArrowLeft: -1, KeyA: -1, ArrowRight: 1, KeyD: 1 };

export const isDrivingKey = (code: string) => code in THROTTLE || code in STEERING;

export function keyAxes(held: ReadonlySet<string>): Axes | null {
  const codes = [...held].filter(isDrivingKey);
  if (codes.length === 0) return null;
  const sum = (of: Record<string, number>) => clamp(codes.reduce((total, code) => total + (of[code] ?? 0), 0));
  return { throttle: sum(THROTTLE), steering: sum(STEERING) };
}

/** What a worn stick can report at rest. */
const DEAD_ZONE = 0.12;
/** Numbers of the standard layout. */
const STEERING_AXIS = 0;
const THROTTLE_AXIS = 1;
const BACK_TRIGGER = 6;
const AHEAD_TRIGGER = 7;
const STOP_BUTTON = 1;

type Pad = Pick<Gamepad, "axes"> & { readonly buttons: readonly Pick<GamepadButton, "value" | "pressed">[] };

const outsideDeadZone = (value: number) =>
  Math.abs(value) <= DEAD_ZONE ? 0 : clamp((value - Math.sign(value) * DEAD_ZONE) / (1 - DEAD_ZONE));

export const asksToStop = (pad: Pad) => pad.buttons[STOP_BUTTON]?.pressed ?? false;

/** The left stick, or the triggers for speed. */
export function gamepadAxes(pad: Pad): Axes | null {
  const triggers = outsideDeadZone(pad.buttons[AHEAD_TRIGGER]?.value ?? 0) - outsideDeadZone(pad.buttons[BACK_TRIGGER]?.value ?? 0);
  const stick = -outsideDeadZone(pad.axes[THROTTLE_AXIS] ?? 0);
  const throttle = Math.abs(triggers) > Math.abs(stick) ? triggers : stick;
  const steering = outsideDeadZone(pad.axes[STEERING_AXIS] ?? 0);
  return throttle === 0 && steering === 0 ? null : { throttle, steering };
}
