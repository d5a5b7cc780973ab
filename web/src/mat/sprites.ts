/** Small pictures that are painted once and kept: cars, their wheels and lights, shadows, and signs of lost messages. */

import { arrow, beacon, DARK, dot, face, fade, follower, leader, lossSign, type LossSign, rim, ring, rounded, shadow, wheel } from "./carPaint";
import { pageFont } from "./colours";

type Paint = (g: CanvasRenderingContext2D) => void;

/** The sizes of sprites are so far apart: each is drawn a little smaller than it was painted. */
const STEP = Math.SQRT2;
/** So many are kept; then all are forgotten. The largest takes 0.3 MB. */
const MOST = 600;
const kept = new Map<string, HTMLCanvasElement>();

/**
 * A sprite by its name, for a side of so many pixels of the device. `paint` paints it, where it isn't kept, around the
 * middle, in halves of the side, x to the front.
 */
function sprite(name: string, sidePx: number, paint: (g: CanvasRenderingContext2D, sidePx: number) => void): HTMLCanvasElement {
  const side = Math.ceil(STEP ** Math.ceil(Math.log(Math.max(4, sidePx)) / Math.log(STEP)));
  const key = `${name} ${side}`;
  const known = kept.get(key);
  if (known) return known;
  if (kept.size >= MOST) kept.clear();
  const canvas = blank(side);
  paint(canvas.getContext("2d")!, side);
  kept.set(key, canvas);
  return canvas;
}

const blank = (side: number): HTMLCanvasElement => Object.assign(document.createElement("canvas"), { width: side, height: side });

/** Paint around the middle, or around a point and smaller, in halves of a side. */
function put(g: CanvasRenderingContext2D, side: number, paint: Paint, x = 0, y = 0, share = 1): void {
  const half = side / 2;
  g.setTransform(half * share, 0, 0, half * share, half * (1 + x), half * (1 + y));
  g.lineJoin = g.lineCap = "round";
  paint(g);
  g.setTransform(1, 0, 0, 1, 0, 0);
}

/** Paint in white and grey, multiplied by a colour. */
function putTinted(g: CanvasRenderingContext2D, side: number, colour: string, paint: Paint): void {
  const [white, tinted] = [blank(side), blank(side)];
  put(white.getContext("2d")!, side, paint);
  const own = tinted.getContext("2d")!;
  own.drawImage(white, 0, 0);
  own.globalCompositeOperation = "multiply";
  own.fillStyle = colour;
  own.fillRect(0, 0, side, side);
  // The colour has filled what was empty too.
  own.globalCompositeOperation = "destination-in";
  own.drawImage(white, 0, 0);
  g.drawImage(tinted, 0, 0);
}

export interface Body {
  colour: string;
  leads: boolean;
  /** Its eyes are closed. */
  blinks: boolean;
}

/** A car without its wheels; `simple`, without a face. In high contrast it is a shape that can't be mistaken: an arrow leads, a ring follows. */
export function bodySprite({ colour, leads, blinks }: Body, simple: boolean, contrast: boolean, sidePx: number): HTMLCanvasElement {
  return sprite(`body ${colour} ${leads} ${blinks} ${simple} ${contrast}`, sidePx, (g, side) => {
    if (contrast) {
      putTinted(g, side, colour, leads ? arrow : ring);
      return;
    }
    putTinted(g, side, colour, leads ? leader : follower);
    if (simple) return;
    put(g, side, face(!blinks));
    if (leads) put(g, side, beacon, -0.36, 0, 0.23);
  });
}

/** How many pictures a turning wheel has, one for each part of a turn of its tread. */
export const TURNS = 4;

export const wheelSprite = (turn: number, sidePx: number) => sprite(`wheel ${turn}`, sidePx, (g, side) => put(g, side, wheel(turn / TURNS)));

export const shadowSprite = (sidePx: number) => sprite("shadow", sidePx, (g, side) => put(g, side, shadow));

const glow: Paint = (g) => fade(g, 0, { 0: "rgba(255,255,255,0.95)", 0.35: "rgba(255,255,255,0.5)", 1: "rgba(255,255,255,0)" });

/** Light on the floor. */
export const glowSprite = (colour: string, sidePx: number) => sprite(`glow ${colour}`, sidePx, (g, side) => putTinted(g, side, colour, glow));

const led: Paint = (g) => {
  fade(g, 0.4, { 0: "rgba(255,255,255,0.75)", 1: "rgba(255,255,255,0)" });
  dot(g, "#fff", 0, 0, 0.45);
  rim(g, 0.12);
};

export const ledSprite = (colour: string, sidePx: number) => sprite(`led ${colour}`, sidePx, (g, side) => putTinted(g, side, colour, led));

export const lossSprite = (sign: LossSign, colour: string, sidePx: number) =>
  sprite(`${sign} ${colour}`, sidePx, (g, side) => putTinted(g, side, colour, lossSign(sign)));

/** A car's number on a plate on its roof. */
export const plateSprite = (number: number, plate: string, sidePx: number) =>
  sprite(`plate ${number} ${plate}`, sidePx, (g, side) =>
    put(g, side, () => {
      rounded(g, plate, [-0.94, -0.8, 1.88, 1.6], 0.5);
      g.font = `700 ${number > 99 ? 0.8 : 1.05}px ${pageFont()}`;
      g.textAlign = "center";
      g.textBaseline = "middle";
      g.fillStyle = DARK;
      g.fillText(String(number), 0, 0.06);
    }),
  );
