/** All cars: bodies in the colours of their words, wheels, LEDs, marks of lost frames, and rings around some. */

import { Container, Graphics, Sprite, type Texture } from "pixi.js";
import { NO_LED, type Picture } from "../api/world";
import { carColour, LEDS, plateColour, type WordColours, type MatTheme } from "./colours";
import { LAMPS, TREADS } from "./carPaint";
import { poseAt, type DanceMove, type DancePose } from "./dance";
import { numberTexture, type Textures } from "./textures";

/** The least size on the screen, so that cars stay visible on a large mat. */
const LEAST_PX = 9;
const LOSS_SHOWN_MS = 500;
const BLINK_MS = 180;
/** More cars than these are drawn as simple sprites. */
const MOST_RICH = 200;
/** A car has a number plate where its number, or at least its colour, can be told. */
const PLATE_PX = 26;
/** Of the tread of a wheel, in half cars; wheels are that far from the middle of the car. */
const TREAD = 0.195;
const TRACK = 0.68;

/** What one car is drawn with besides its body. Lengths are half cars. */
interface Rig {
  under: Container;
  over: Container;
  glow: Sprite;
  wheels: readonly [Sprite, Sprite];
  face: Sprite;
  number: Sprite | null;
  blinksUntil: number;
  /** How far each wheel has turned, in treads. */
  turned: [left: number, right: number];
  last: { x: number; y: number; heading: number } | null;
}

export class CarLayer {
  readonly view = new Container();
  /** Shadows and light, below all cars. */
  private readonly floor = new Container();
  private readonly wheels = new Container();
  private readonly bodies = new Container<Sprite>();
  private readonly faces = new Container();
  private readonly lights = new Container<Sprite>();
  private readonly marks = new Container<Sprite>();
  private readonly rings = new Graphics();
  private rigs: Rig[] = [];
  private lostAt = new Float64Array();
  private diameter = 150;
  leads: ReadonlySet<number> = new Set();
  private contrast = false;
  /** The cars with a ring around them. */
  ringed: readonly number[] = [];
  /** Nothing moves but the cars themselves. */
  still = false;
  private dance: { leader: readonly DanceMove[]; followers: readonly DanceMove[]; sinceMs: number } | null = null;

  constructor(
    private readonly textures: Textures,
    private theme: MatTheme,
  ) {
    this.view.addChild(this.floor, this.rings, this.wheels, this.bodies, this.faces, this.lights, this.marks);
  }

  setTheme(theme: MatTheme): void {
    this.theme = theme;
    this.markLosses();
  }

  /** High contrast: a shape for leaders, another for followers, and nothing else. */
  setContrast(contrast: boolean): void {
    if (contrast === this.contrast) return;
    this.contrast = contrast;
    this.wheels.visible = this.floor.visible = !contrast;
    this.setCars(this.bodies.children.length, this.leads, this.diameter / 2000);
  }

  setCars(cars: number, leads: ReadonlySet<number>, radiusM: number): void {
    this.diameter = 2000 * radiusM;
    this.leads = leads;
    this.lostAt = new Float64Array(cars).fill(-Infinity);
    for (const layer of [this.floor, this.wheels, this.bodies, this.faces, this.lights, this.marks]) {
      for (const old of layer.removeChildren()) old.destroy({ children: true });
    }
    this.rigs = [];
    for (let k = 0; k < cars; k++) {
      this.bodies.addChild(centred(this.bodyOf(leads.has(k))));
      this.lights.addChild(centred(this.textures.led)).visible = false;
      this.marks.addChild(centred(this.textures.collision)).visible = false;
      if (cars <= MOST_RICH) this.rigs.push(this.rig(leads.has(k)));
    }
    this.markLosses();
  }

  private bodyOf(leads: boolean): Texture {
    const { arrow, ring, leader, follower } = this.textures;
    if (this.contrast) return leads ? arrow : ring;
    return leads ? leader : follower;
  }

  private rig(leads: boolean): Rig {
    const under = this.floor.addChild(new Container());
    const over = this.faces.addChild(new Container());
    const shadow = under.addChild(sized(this.textures.shadow, 2.5));
    shadow.position.set(-0.06, -0.1);
    const glow = under.addChild(sized(this.textures.glow, 3.4));
    glow.visible = false;
    const rims = this.wheels.addChild(new Container());
    const [left, right] = [TRACK, -TRACK].map((y) => {
      const wheel = rims.addChild(sized(this.textures.wheels[0]!, 0.78));
      wheel.position.set(-0.06, y);
      return wheel;
    });
    const face = over.addChild(sized(this.textures.face, 2));
    face.visible = !this.contrast;
    if (leads && !this.contrast) over.addChild(sized(this.textures.beacon, 0.46)).position.set(-0.36, 0);
    return { under, over, glow, wheels: [left!, right!], face, number: null, blinksUntil: -Infinity, turned: [0, 0], last: null };
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

  /** A frame was heard by this car: it blinks. */
  hear(car: number, atMs: number): void {
    const rig = this.rigs[car];
    if (rig) rig.blinksUntil = atMs + BLINK_MS;
  }

  /** Let the cars dance from now on, unless nothing may move. */
  celebrate(leader: readonly DanceMove[], followers: readonly DanceMove[], atMs: number): void {
    if (!this.still) this.dance = { leader, followers, sinceMs: atMs };
  }

  /** How a car dances now; null once its dance is over. */
  private poseOf(k: number, atMs: number): DancePose | null {
    return this.dance && poseAt(this.leads.has(k) ? this.dance.leader : this.dance.followers, atMs - this.dance.sinceMs);
  }

  take(picture: Picture, colours: WordColours): void {
    for (let k = 0; k < picture.cars; k++) {
      this.bodies.children[k]!.tint = carColour(colours, picture.index[k]!, picture.flags[k]!);
      const led = picture.led[k]!;
      const lit = led !== NO_LED;
      const colour = LEDS[led] ?? 0xffffff;
      const light = this.lights.children[k]!;
      light.visible = lit;
      light.tint = colour;
      const rig = this.rigs[k];
      if (!rig) continue;
      rig.glow.visible = lit;
      rig.glow.tint = colour;
      const [x, y] = LAMPS[led] ?? [0, 0];
      rig.glow.position.set(x, y);
    }
  }

  /** Draw a moment; true while a mark or a blink is still shown. */
  draw(drawn: Drawn, picture: Picture | null, scale: number, atMs: number): boolean {
    const side = Math.max(this.diameter, LEAST_PX / scale);
    let lasts = false;
    for (let k = 0; k < drawn.x.length; k++) {
      const pose = this.poseOf(k, atMs);
      const size = (this.leads.has(k) ? side * 1.15 : side) * (1 + (pose?.lift ?? 0));
      const ahead = ((pose?.ahead ?? 0) * size) / 2;
      const x = drawn.x[k]! * 1000 + ahead * Math.cos(drawn.heading[k]!);
      const y = drawn.y[k]! * 1000 + ahead * Math.sin(drawn.heading[k]!);
      const heading = drawn.heading[k]! + (pose?.turn ?? 0);
      lasts ||= pose !== null;
      const body = this.bodies.children[k]!;
      place(body, x, y, size);
      body.rotation = heading;
      const rig = this.rigs[k];
      if (rig) lasts = this.drawRig(rig, k, { x, y, heading }, size / 2, scale, atMs) || lasts;
      this.drawLight(k, picture?.led[k] ?? NO_LED, x, y, heading, size);
      lasts = this.drawMark(k, x, y, scale, side, atMs) || lasts;
    }
    this.drawRings(drawn, side, scale);
    if (!lasts) this.dance = null;
    return lasts;
  }

  private drawRig(rig: Rig, k: number, at: { x: number; y: number; heading: number }, half: number, scale: number, atMs: number): boolean {
    const rims = rig.wheels[0].parent!;
    for (const part of [rig.under, rig.over, rims]) {
      part.position.set(at.x, at.y);
      part.rotation = at.heading;
      part.scale.set(half);
    }
    if (!this.still) this.turnWheels(rig, at, half);
    const blinks = atMs < rig.blinksUntil;
    rig.face.texture = blinks ? this.textures.blink : this.textures.face;
    const numbered = half * 2 * scale >= PLATE_PX && !this.leads.has(k);
    if (numbered && !rig.number) {
      rig.number = rig.over.addChild(sized(numberTexture(k, this.contrast ? "#ffffff" : plateColour(k)), 0.62));
      rig.number.position.set(-0.34, 0);
      // The world's y points up, that of a picture down.
      rig.number.scale.y *= -1;
    }
    if (rig.number) rig.number.visible = numbered;
    return blinks;
  }

  /** Turn each wheel as far as it has rolled since the last drawing. */
  private turnWheels(rig: Rig, at: { x: number; y: number; heading: number }, half: number): void {
    const { last, turned } = rig;
    rig.last = at;
    if (!last) return;
    const ahead = ((at.x - last.x) * Math.cos(at.heading) + (at.y - last.y) * Math.sin(at.heading)) / half;
    if (Math.abs(ahead) > 2) return;
    const around = shortestTurn(at.heading - last.heading) * TRACK;
    turned[0] += (ahead - around) / TREAD;
    turned[1] += (ahead + around) / TREAD;
    rig.wheels.forEach((wheel, side) => {
      const phase = Math.floor((turned[side]! - Math.floor(turned[side]!)) * TREADS);
      wheel.texture = this.textures.wheels[phase]!;
    });
  }

  private drawLight(k: number, led: number, x: number, y: number, heading: number, size: number): void {
    const light = this.lights.children[k]!;
    if (!light.visible) return;
    const lamp = this.rigs.length ? LAMPS[led] : undefined;
    const [ahead, aside] = lamp ?? [-0.72, 0];
    const [cos, sin] = [Math.cos(heading), Math.sin(heading)];
    place(light, x + (size / 2) * (ahead * cos - aside * sin), y + (size / 2) * (ahead * sin + aside * cos), (lamp ? 0.44 : 0.62) * size);
  }

  private drawMark(k: number, x: number, y: number, scale: number, side: number, atMs: number): boolean {
    const age = (atMs - this.lostAt[k]!) / LOSS_SHOWN_MS;
    const mark = this.marks.children[k]!;
    mark.visible = age < 1;
    if (!mark.visible) return false;
    place(mark, x, y + side * 0.62, Math.max(side * 0.26, 10 / scale));
    mark.alpha = Math.min(1, 2 - 2 * age);
    return true;
  }

  private drawRings({ x, y }: Drawn, side: number, scale: number): void {
    this.rings.clear();
    for (const k of new Set(this.ringed)) {
      if (k < x.length) this.rings.circle(x[k]! * 1000, y[k]! * 1000, side * 0.72).stroke({ width: 3 / scale, color: this.theme.accent });
    }
  }
}

/** A sprite as wide as so many halves of a car, in a rig. */
function sized(texture: Sprite["texture"], width: number): Sprite {
  const sprite = centred(texture);
  sprite.scale.set(width / texture.width);
  return sprite;
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
