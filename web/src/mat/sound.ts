/** The sound of the stage, made in code: motors hum with the wheels, frames tick, LEDs chime. */

import { eventsOf, NO_LED, type Picture } from "../api/world";

/** Notes that sound well together, one an LED. */
const CHIMES_HZ = [523.25, 659.25, 783.99, 987.77];
/** One note a star, and one more for all three. */
const STARS_HZ = [659.25, 783.99, 1046.5, 1318.51];
const STAR_GAP_S = 0.16;
const HUM_HZ = 52;
const LOUDEST = 0.05;
/** More ticks or chimes than these would be noise. */
const TICK_GAP_S = 0.07;
const CHIME_GAP_S = 0.12;

/** A context that runs costs a tenth of a processor, also while it is silent. The longest note is shorter. */
const REST_MS = 3000;

interface Heard {
  /** The mean speed of all wheels, 0 to 1. */
  motors: number;
  /** Whether a leader sent a frame. */
  ticks: boolean;
  /** The LED that went on, of the first car whose LED did. */
  chime: number | null;
}

/** What there is to hear in a picture after the one before. */
export function heardIn(picture: Picture, before: Picture | null, leads: ReadonlySet<number>): Heard {
  let sum = 0;
  let chime: number | null = null;
  const continues = before?.cars === picture.cars && !picture.fresh;
  for (let k = 0; k < picture.cars; k++) {
    sum += (picture.wheels[k]! & 3) / 3;
    const led = picture.led[k]!;
    if (continues && chime === null && led !== NO_LED && before.led[k] !== led) chime = led;
  }
  let ticks = false;
  for (const { kind, car } of eventsOf(picture)) ticks ||= kind === "frame" && leads.has(car);
  return { motors: picture.cars ? sum / picture.cars : 0, ticks, chime };
}

/** The notes for so many stars earned at once. */
export function starNotes(stars: number): readonly number[] {
  return STARS_HZ.slice(0, stars >= 3 ? STARS_HZ.length : Math.max(0, stars));
}

/** Browsers allow sound only after a key or a click: it begins with the first picture after one. */
export class Sound {
  private context: AudioContext | null = null;
  private resting: ReturnType<typeof setTimeout> | undefined;
  private hum: { gain: GainNode; oscillator: OscillatorNode } | null = null;
  private before: Picture | null = null;
  private tickedAt = 0;
  private chimedAt = 0;

  /** Sound like this picture; silent where it is in the past or `on` is false. */
  take(picture: Picture, leads: ReadonlySet<number>, on: boolean, playing: boolean): void {
    const { motors, ticks, chime } = heardIn(picture, this.before, leads);
    this.before = picture;
    if (!on || picture.past || !playing || !navigator.userActivation.hasBeenActive) {
      this.silence();
      return;
    }
    const context = this.running();
    const now = context.currentTime;
    this.hum ??= this.makeHum(context);
    this.hum.gain.gain.setTargetAtTime(motors ? LOUDEST * (0.3 + 0.7 * motors) : 0, now, 0.08);
    this.hum.oscillator.frequency.setTargetAtTime(HUM_HZ * (1 + motors), now, 0.08);
    if (ticks && now - this.tickedAt > TICK_GAP_S) {
      this.note(context, 2100, 0.03, LOUDEST * 0.35);
      this.tickedAt = now;
    }
    if (chime !== null && now - this.chimedAt > CHIME_GAP_S) {
      this.note(context, CHIMES_HZ[chime] ?? CHIMES_HZ[0]!, 0.5, LOUDEST);
      this.chimedAt = now;
    }
  }

  /** Stars were earned. */
  celebrate(stars: number): void {
    if (!navigator.userActivation.hasBeenActive) return;
    const context = this.running();
    starNotes(stars).forEach((hz, k) => this.note(context, hz, 0.7, LOUDEST * 1.6, k * STAR_GAP_S));
  }

  private running(): AudioContext {
    const context = (this.context ??= new AudioContext());
    if (context.state === "suspended") void context.resume();
    clearTimeout(this.resting);
    this.resting = setTimeout(() => void context.suspend(), REST_MS);
    return context;
  }

  silence(): void {
    if (this.hum && this.context) this.hum.gain.gain.setTargetAtTime(0, this.context.currentTime, 0.05);
  }

  close(): void {
    clearTimeout(this.resting);
    void this.context?.close();
    this.context = this.hum = null;
  }

  private makeHum(context: AudioContext) {
    const gain = context.createGain();
    const filter = context.createBiquadFilter();
    const oscillator = context.createOscillator();
    gain.gain.value = 0;
    filter.frequency.value = 320;
    oscillator.type = "sawtooth";
    oscillator.connect(filter).connect(gain).connect(context.destination);
    oscillator.start();
    return { gain, oscillator };
  }

  private note(context: AudioContext, hz: number, seconds: number, loud: number, inS = 0): void {
    const now = context.currentTime + inS;
    const gain = context.createGain();
    const oscillator = context.createOscillator();
    oscillator.frequency.value = hz;
    oscillator.type = "triangle";
    gain.gain.setValueAtTime(loud, now);
    gain.gain.exponentialRampToValueAtTime(0.0001, now + seconds);
    oscillator.connect(gain).connect(context.destination);
    oscillator.start(now);
    oscillator.stop(now + seconds);
  }
}
