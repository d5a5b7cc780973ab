/** A person who stands or walks, seen from the front: 1 high, the feet at 0, the head up. */

import { DARK, dot, rim, rounded } from "./carPaint";

const SKIN = "#f3c9a0";
const HAIR = "#4a2f1d";
const TROUSERS = "#3c4f76";

function limb(g: CanvasRenderingContext2D, colour: string, width: number, from: readonly [number, number], to: readonly [number, number]): void {
  for (const [ink, wide] of [[DARK, width + 0.035], [colour, width]] as const) {
    g.strokeStyle = ink;
    g.lineWidth = wide;
    g.beginPath();
    g.moveTo(...from);
    g.lineTo(...to);
    g.stroke();
  }
}

/** Paint somebody with a shirt of a colour; `step` is how far a step is, from 0 to 1, or null for who stands. */
export function figure(g: CanvasRenderingContext2D, shirt: string, step: number | null): void {
  const swing = step === null ? 0.03 : 0.11 * Math.sin(2 * Math.PI * step);
  g.lineCap = g.lineJoin = "round";
  g.fillStyle = "rgba(10,16,30,0.28)";
  g.beginPath();
  g.ellipse(0, 0, 0.24, 0.07, 0, 0, 2 * Math.PI);
  g.fill();
  limb(g, shirt, 0.08, [-0.13, -0.6], [-0.18 - swing, -0.36]);
  limb(g, TROUSERS, 0.1, [-0.06, -0.34], [-0.06 + swing, -0.03]);
  limb(g, TROUSERS, 0.1, [0.06, -0.34], [0.06 - swing, -0.03]);
  limb(g, shirt, 0.08, [0.13, -0.6], [0.18 + swing, -0.36]);
  rounded(g, shirt, [-0.14, -0.66, 0.28, 0.36], 0.09);
  rim(g, 0.02);
  dot(g, DARK, 0, -0.82, 0.165);
  dot(g, HAIR, 0, -0.83, 0.148);
  dot(g, SKIN, 0.02, -0.79, 0.125);
  dot(g, DARK, -0.03, -0.8, 0.018);
  dot(g, DARK, 0.07, -0.8, 0.018);
}
