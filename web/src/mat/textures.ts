/** The small pictures that the mat is drawn with; white parts are coloured by a sprite's tint. */

import { Texture } from "pixi.js";

const SIZE = 128;
const DARK = "#1b2330";
const GLASS = "#27364a";

export interface Textures {
  follower: Texture;
  leader: Texture;
  led: Texture;
  ring: Texture;
  collision: Texture;
  missed: Texture;
  person: Texture;
}

/** Draw around the middle, in halves of the picture's side, x to the front. */
function draw(paint: (g: CanvasRenderingContext2D) => void, size = SIZE): Texture {
  const canvas = document.createElement("canvas");
  canvas.width = canvas.height = size;
  const g = canvas.getContext("2d")!;
  g.translate(size / 2, size / 2);
  g.scale(size / 2, size / 2);
  g.lineJoin = "round";
  g.lineCap = "round";
  paint(g);
  const texture = Texture.from(canvas);
  texture.source.autoGenerateMipmaps = true;
  return texture;
}

function rounded(g: CanvasRenderingContext2D, fill: string, box: readonly [number, number, number, number], radius: number) {
  g.fillStyle = fill;
  g.beginPath();
  g.roundRect(...box, radius);
  g.fill();
}

function wheels(g: CanvasRenderingContext2D) {
  rounded(g, DARK, [-0.3, -0.88, 0.6, 0.24], 0.08);
  rounded(g, DARK, [-0.3, 0.64, 0.6, 0.24], 0.08);
}

function headlights(g: CanvasRenderingContext2D, x: number, y: number) {
  g.fillStyle = "#fff7d1";
  g.strokeStyle = DARK;
  g.lineWidth = 0.05;
  for (const side of [-y, y]) {
    g.beginPath();
    g.arc(x, side, 0.1, 0, 2 * Math.PI);
    g.fill();
    g.stroke();
  }
}

function outlined(g: CanvasRenderingContext2D, width: number) {
  g.fillStyle = "#fff";
  g.fill();
  g.strokeStyle = DARK;
  g.lineWidth = width;
  g.stroke();
}

function follower(g: CanvasRenderingContext2D) {
  wheels(g);
  g.beginPath();
  g.roundRect(-0.84, -0.6, 1.68, 1.2, [0.22, 0.5, 0.5, 0.22]);
  outlined(g, 0.08);
  rounded(g, GLASS, [0.18, -0.44, 0.34, 0.88], 0.14);
  headlights(g, 0.7, 0.34);
}

/** A leader differs from followers by its shape too: a pointed nose and a star on its roof. */
function leader(g: CanvasRenderingContext2D) {
  wheels(g);
  g.beginPath();
  g.moveTo(0.98, 0);
  for (const [x, y] of [
    [0.5, 0.66],
    [-0.8, 0.66],
    [-0.92, 0.4],
    [-0.92, -0.4],
    [-0.8, -0.66],
    [0.5, -0.66],
  ] as const) {
    g.lineTo(x, y);
  }
  g.closePath();
  outlined(g, 0.1);
  g.fillStyle = GLASS;
  g.beginPath();
  g.moveTo(0.72, 0);
  g.lineTo(0.38, 0.42);
  g.lineTo(0.38, -0.42);
  g.closePath();
  g.fill();
  star(g, -0.24, 0, 0.46);
}

function star(g: CanvasRenderingContext2D, x: number, y: number, radius: number) {
  g.beginPath();
  for (let k = 0; k < 10; k++) {
    const angle = (k * Math.PI) / 5;
    const reach = k % 2 ? radius * 0.45 : radius;
    g.lineTo(x + reach * Math.cos(angle), y + reach * Math.sin(angle));
  }
  g.closePath();
  outlined(g, 0.07);
}

function led(g: CanvasRenderingContext2D) {
  const glow = g.createRadialGradient(0, 0, 0.4, 0, 0, 1);
  glow.addColorStop(0, "rgba(255,255,255,0.75)");
  glow.addColorStop(1, "rgba(255,255,255,0)");
  g.fillStyle = glow;
  g.fillRect(-1, -1, 2, 2);
  g.beginPath();
  g.arc(0, 0, 0.45, 0, 2 * Math.PI);
  outlined(g, 0.12);
}

function ring(g: CanvasRenderingContext2D) {
  g.strokeStyle = "#fff";
  g.lineWidth = 0.035;
  g.beginPath();
  g.arc(0, 0, 0.975, 0, 2 * Math.PI);
  g.stroke();
}

function strokeTwice(g: CanvasRenderingContext2D, path: () => void) {
  for (const [colour, width] of [
    [DARK, 0.5],
    ["#fff", 0.28],
  ] as const) {
    g.strokeStyle = colour;
    g.lineWidth = width;
    g.beginPath();
    path();
    g.stroke();
  }
}

function collision(g: CanvasRenderingContext2D) {
  strokeTwice(g, () => {
    g.moveTo(-0.6, -0.6);
    g.lineTo(0.6, 0.6);
    g.moveTo(-0.6, 0.6);
    g.lineTo(0.6, -0.6);
  });
}

function missed(g: CanvasRenderingContext2D) {
  strokeTwice(g, () => {
    g.moveTo(0, -0.62);
    g.lineTo(0.62, 0);
    g.lineTo(0, 0.62);
    g.lineTo(-0.62, 0);
    g.closePath();
  });
}

function person(g: CanvasRenderingContext2D) {
  g.beginPath();
  g.ellipse(0, 0, 0.42, 0.9, 0, 0, 2 * Math.PI);
  outlined(g, 0.08);
  g.beginPath();
  g.arc(0.06, 0, 0.4, 0, 2 * Math.PI);
  outlined(g, 0.08);
  g.fillStyle = DARK;
  g.beginPath();
  g.arc(0.34, 0, 0.1, 0, 2 * Math.PI);
  g.fill();
}

export function makeTextures(): Textures {
  return {
    follower: draw(follower),
    leader: draw(leader),
    led: draw(led, 64),
    ring: draw(ring, 256),
    collision: draw(collision, 64),
    missed: draw(missed, 64),
    person: draw(person),
  };
}
