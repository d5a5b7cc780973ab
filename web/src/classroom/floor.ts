/** The floor of a world on a canvas, as the studio's stage has it. */

import type { FloorName } from "../mat/document";
import { type FloorPen, groundOf, paintFloor } from "../mat/floors";

/** On a smaller canvas the floor has one colour. */
const PATTERN_FROM_PX = 500;

/** A pen for a canvas; each shape is a path of its own. */
function penOn(context: CanvasRenderingContext2D): FloorPen {
  context.beginPath();
  const draw = (color: number, alpha: number, act: () => void): FloorPen => {
    context.globalAlpha = alpha;
    context.fillStyle = context.strokeStyle = `#${color.toString(16).padStart(6, "0")}`;
    act();
    context.globalAlpha = 1;
    context.beginPath();
    return pen;
  };
  const shape = (act: () => void): FloorPen => {
    act();
    return pen;
  };
  const pen: FloorPen = {
    rect: (...box) => shape(() => context.rect(...box)),
    roundRect: (...box) => shape(() => context.roundRect(...box)),
    circle: (x, y, radius) =>
      shape(() => {
        context.moveTo(x + radius, y);
        context.arc(x, y, radius, 0, 2 * Math.PI);
      }),
    moveTo: (x, y) => shape(() => context.moveTo(x, y)),
    lineTo: (x, y) => shape(() => context.lineTo(x, y)),
    fill: ({ color, alpha = 1 }) => draw(color, alpha, () => context.fill()),
    stroke: ({ width, color, alpha = 1 }) =>
      draw(color, alpha, () => {
        context.lineWidth = width;
        context.stroke();
      }),
  };
  return pen;
}

/** Draw a floor of this size in metres, whose lower left corner is at a point of the canvas; `plain` is the page's colour. */
export function drawFloor(
  context: CanvasRenderingContext2D,
  name: FloorName,
  { left, bottom, scale, size_m, plain }: { left: number; bottom: number; scale: number; size_m: readonly [number, number]; plain: string },
): void {
  const [width, height] = size_m;
  context.save();
  context.translate(left, bottom);
  context.scale(scale / 1000, -scale / 1000);
  context.fillStyle = groundOf(name) ?? plain;
  context.fillRect(0, 0, width * 1000, height * 1000);
  if (width * scale >= PATTERN_FROM_PX) paintFloor(penOn(context), name, width * 1000, height * 1000);
  context.restore();
}
