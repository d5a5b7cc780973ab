/** All cars: bodies in the colours of their words, LEDs, marks of lost frames, and a ring around the chosen one. */

import { Container, Graphics, Sprite } from "pixi.js";
import { NO_LED, type Picture } from "../api/world";
import { carColour, LEDS, type WordColours, type MatTheme } from "./colours";
import type { Textures } from "./textures";

/** The least size on the screen, so that cars stay visible on a large mat. */
const LEAST_PX = 9;
const LOSS_SHOWN_MS = 500;

export class CarLayer {
  readonly view = new Container();
  private readonly bodies = new Container<Sprite>();
  private readonly lights = new Container<Sprite>();
  private readonly marks = new Container<Sprite>();
  private readonly chosenRing = new Graphics();
  private lostAt = new Float64Array();
  private diameter = 150;
  private leads: ReadonlySet<number> = new Set();
  chosen: number | null = null;

  constructor(
    private readonly textures: Textures,
    private theme: MatTheme,
  ) {
    this.view.addChild(this.chosenRing, this.bodies, this.lights, this.marks);
  }

  setTheme(theme: MatTheme): void {
    this.theme = theme;
    this.markLosses();
  }

  setCars(cars: number, leads: ReadonlySet<number>, radiusM: number): void {
    this.diameter = 2000 * radiusM;
    this.leads = leads;
    this.lostAt = new Float64Array(cars).fill(-Infinity);
    for (const layer of [this.bodies, this.lights, this.marks]) {
      for (const old of layer.removeChildren()) old.destroy();
    }
    for (let k = 0; k < cars; k++) {
      this.bodies.addChild(centred(leads.has(k) ? this.textures.leader : this.textures.follower));
      this.lights.addChild(centred(this.textures.led)).visible = false;
      this.marks.addChild(centred(this.textures.collision)).visible = false;
    }
    this.markLosses();
  }

  private markLosses(): void {
    for (const mark of this.marks.children) mark.tint = this.theme.lost;
  }

  /** A frame was lost at this car. */
  lose(car: number, collided: boolean, atMs: number): void {
    const mark = this.marks.children[car];
    if (!mark) return;
    mark.texture = collided ? this.textures.collision : this.textures.missed;
    this.lostAt[car] = atMs;
  }

  take(picture: Picture, colours: WordColours): void {
    for (let k = 0; k < picture.cars; k++) {
      this.bodies.children[k]!.tint = carColour(colours, picture.index[k]!, picture.flags[k]!);
      const light = this.lights.children[k]!;
      const led = picture.led[k]!;
      light.visible = led !== NO_LED;
      if (light.visible) light.tint = LEDS[led] ?? 0xffffff;
    }
  }

  /** Draw a moment; true while a mark is still shown. */
  draw(drawn: Drawn, scale: number, atMs: number): boolean {
    const side = Math.max(this.diameter, LEAST_PX / scale);
    let marked = false;
    for (let k = 0; k < drawn.x.length; k++) {
      const x = drawn.x[k]! * 1000;
      const y = drawn.y[k]! * 1000;
      const heading = drawn.heading[k]!;
      const body = this.bodies.children[k]!;
      const size = this.leads.has(k) ? side * 1.15 : side;
      place(body, x, y, size);
      body.rotation = heading;
      const light = this.lights.children[k]!;
      if (light.visible) place(light, x - 0.36 * side * Math.cos(heading), y - 0.36 * side * Math.sin(heading), 0.62 * side);
      marked = this.drawMark(k, x, y, scale, side, atMs) || marked;
    }
    this.drawChosen(drawn, side, scale);
    return marked;
  }

  private drawMark(k: number, x: number, y: number, scale: number, side: number, atMs: number): boolean {
    const age = (atMs - this.lostAt[k]!) / LOSS_SHOWN_MS;
    const mark = this.marks.children[k]!;
    mark.visible = age < 1;
    if (!mark.visible) return false;
    place(mark, x, y + side * 0.55, Math.max(side * 0.6, 12 / scale));
    mark.alpha = Math.min(1, 2 - 2 * age);
    return true;
  }

  private drawChosen(drawn: Drawn, side: number, scale: number): void {
    this.chosenRing.clear();
    const k = this.chosen;
    if (k === null || k >= drawn.x.length) return;
    this.chosenRing
      .circle(drawn.x[k]! * 1000, drawn.y[k]! * 1000, side * 0.72)
      .stroke({ width: 3 / scale, color: this.theme.accent });
  }
}

function centred(texture: Sprite["texture"]): Sprite {
  const sprite = new Sprite(texture);
  sprite.anchor.set(0.5);
  return sprite;
}

function place(sprite: Sprite, x: number, y: number, side: number): void {
  sprite.position.set(x, y);
  sprite.scale.set(side / sprite.texture.width);
}

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
  private now: Picture | null = null;
  private arrivedAt = 0;
  private interval = 33;
  drawn: Drawn = placesOf(0);

  get picture(): Picture | null {
    return this.now;
  }

  take(picture: Picture, atMs: number): void {
    const continues = this.now?.cars === picture.cars && !picture.fresh && !picture.past && !this.now.past;
    this.before = continues ? this.now : null;
    // A long pause between two pictures must not slow the next drawing down.
    if (continues) this.interval += (Math.min(100, Math.max(16, atMs - this.arrivedAt)) - this.interval) / 4;
    this.now = picture;
    this.arrivedAt = atMs;
    if (this.drawn.x.length !== picture.cars) {
      this.drawn = placesOf(picture.cars);
    }
  }

  /** Forget the pictures: there are other cars now. */
  forget(): void {
    this.before = this.now = null;
    this.drawn = placesOf(0);
  }

  /** Compute `drawn` for this moment; true if a later moment would differ. */
  advance(atMs: number): boolean {
    if (!this.now) return false;
    const share = this.before ? Math.min(1, (atMs - this.arrivedAt) / this.interval) : 1;
    between(this.before ?? this.now, this.now, share, this.drawn);
    return share < 1;
  }
}

export function between(a: Picture, b: Picture, share: number, drawn: Drawn): void {
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
