/** Cars in high contrast: white shapes that take the colour of a word, and differ without it. */

import { dot } from "./carPaint";

/** Leaders. */
export function arrow(g: CanvasRenderingContext2D) {
  g.beginPath();
  g.moveTo(0.98, 0);
  g.lineTo(-0.86, 0.9);
  g.lineTo(-0.46, 0);
  g.lineTo(-0.86, -0.9);
  g.closePath();
  g.fillStyle = g.strokeStyle = "#fff";
  g.lineWidth = 0.08;
  g.fill();
  g.stroke();
}

/** Followers; the wedge in it shows their heading. */
export function ring(g: CanvasRenderingContext2D) {
  dot(g, "#fff", 0, 0, 0.72);
  g.fillStyle = "#000";
  g.beginPath();
  g.moveTo(0.62, 0);
  g.lineTo(0.12, 0.36);
  g.lineTo(0.12, -0.36);
  g.closePath();
  g.fill();
}
