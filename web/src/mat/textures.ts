/** The small pictures that the mat is drawn with; white parts are coloured by a sprite's tint. */

import { Texture } from "pixi.js";
import { arrow, beacon, DARK, dot, face, fade, follower, leader, lossSign, outlined, rim, ring, rounded, shadow, TREADS, wheel } from "./carPaint";
import { pageFont } from "./colours";

const SIZE = 128;

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

const glow = (g: CanvasRenderingContext2D) => fade(g, 0, { 0: "rgba(255,255,255,0.95)", 0.35: "rgba(255,255,255,0.5)", 1: "rgba(255,255,255,0)" });

function led(g: CanvasRenderingContext2D) {
  fade(g, 0.4, { 0: "rgba(255,255,255,0.75)", 1: "rgba(255,255,255,0)" });
  dot(g, "#fff", 0, 0, 0.45);
  rim(g, 0.12);
}

function person(g: CanvasRenderingContext2D) {
  g.beginPath();
  g.ellipse(0, 0, 0.42, 0.9, 0, 0, 2 * Math.PI);
  outlined(g, 0.08);
  dot(g, "#fff", 0.06, 0, 0.4);
  rim(g, 0.08);
  dot(g, DARK, 0.34, 0, 0.1);
}

/** A car's number on a plate on its roof; made when it is needed first. */
export function numberTexture(number: number, plate: string): Texture {
  return draw((g) => {
    rounded(g, plate, [-0.94, -0.8, 1.88, 1.6], 0.5);
    g.font = `700 ${number > 99 ? 0.8 : 1.05}px ${pageFont()}`;
    g.textAlign = "center";
    g.textBaseline = "middle";
    g.fillStyle = DARK;
    g.fillText(String(number), 0, 0.06);
  }, 48);
}

export type Textures = ReturnType<typeof makeTextures>;

export function makeTextures() {
  return {
    // Bodies to be tinted.
    follower: draw(follower),
    leader: draw(leader),
    // Shapes that can't be mistaken for each other, for high contrast: an arrow that leads, and a ring that follows.
    arrow: draw(arrow),
    ring: draw(ring),
    // What lies over a body and isn't tinted: eyes open and closed.
    face: draw(face(true)),
    blink: draw(face(false)),
    // A wheel at each part of a turn of its tread.
    wheels: Array.from({ length: TREADS }, (_, k) => draw(wheel(k / TREADS), 64)),
    shadow: draw(shadow, 64),
    glow: draw(glow, 64),
    beacon: draw(beacon, 48),
    led: draw(led, 64),
    collision: draw(lossSign("collision"), 64),
    missed: draw(lossSign("missed"), 64),
    person: draw(person),
  };
}
