/** Draws shapes of the world as they are seen from behind a car. Lengths are metres. */

import type { Size } from "./camera";
import { dot } from "./carPaint";
import type { Point } from "./document";
import { type Eye, type Lens, lensOf, scaleAt, seen } from "./perspective";

export class ChasePen {
  eye: Eye = { x: 0, y: 0, heading: 0, highM: 1 };
  lens: Lens = { middle: 0, horizon: 0, focus: 1 };
  private sheer = 1;

  constructor(readonly g: CanvasRenderingContext2D) {}

  /** Look from here from now on. */
  look(eye: Eye, size: Size): void {
    this.eye = eye;
    this.lens = lensOf(size);
  }

  /** Paint something so that what is behind it is seen, by a share of 0 (not seen itself) to 1. */
  through(share: number, paint: () => void): void {
    this.sheer = this.g.globalAlpha = share;
    paint();
    this.sheer = this.g.globalAlpha = 1;
  }

  /** Where a point is in the picture; empty where it isn't seen. */
  spot(x: number, y: number, z: number): number[] {
    return seen(this.eye, this.lens, [x, y, z], false);
  }

  /** How many pixels a metre takes there; 0 where it isn't seen. */
  scaleAt(x: number, y: number): number {
    return scaleAt(this.eye, this.lens, x, y);
  }

  trace(points: readonly number[]): void {
    this.g.beginPath();
    for (let at = 0; at < points.length; at += 2) this.g.lineTo(points[at]!, points[at + 1]!);
  }

  polygon(corners: readonly number[], colour: string, alpha = 1): number[] {
    const points = seen(this.eye, this.lens, corners);
    if (points.length < 6) return [];
    this.trace(points);
    this.g.closePath();
    this.g.globalAlpha = alpha * this.sheer;
    this.g.fillStyle = colour;
    this.g.fill();
    this.g.globalAlpha = this.sheer;
    return points;
  }

  line(corners: readonly number[], colour: string, widthPx: number, alpha = 1): void {
    const points = seen(this.eye, this.lens, corners, false);
    if (points.length < 4) return;
    this.trace(points);
    this.g.globalAlpha = alpha * this.sheer;
    this.g.strokeStyle = colour;
    this.g.lineWidth = widthPx;
    this.g.stroke();
    this.g.globalAlpha = this.sheer;
  }

  /** An upright or level face, darker by a share, with a rim where one is wanted. */
  side(corners: readonly number[], colour: string, rim: string | null, darker: number): void {
    if (!this.polygon(corners, colour).length) return;
    if (darker) {
      this.g.globalAlpha = darker * this.sheer;
      this.g.fillStyle = "#000";
      this.g.fill();
      this.g.globalAlpha = this.sheer;
    }
    this.g.strokeStyle = rim ?? "rgba(20,26,40,0.35)";
    this.g.lineWidth = rim ? 2 : 1;
    this.g.stroke();
  }

  /** The sides of an outline that look this way. */
  facing(corners: readonly Point[]): [Point, Point][] {
    const turn = Math.sign(areaOf(corners)) || 1;
    const sides = corners.map((corner, k): [Point, Point] => [corner, corners[(k + 1) % corners.length]!]);
    return sides.filter(([[ax, ay], [bx, by]]) => ((by - ay) * (this.eye.x - ax) - (bx - ax) * (this.eye.y - ay)) * turn > 0);
  }

  /** A shape given by points of the picture. */
  flat(points: readonly number[], colour: string): void {
    this.trace(points);
    this.g.fillStyle = colour;
    this.g.fill();
  }

  /** A block that stands on the floor, or `low` above it: the sides that look this way, and its top. */
  prism(corners: readonly Point[], high: number, colour: string, rim: string | null, low = 0): void {
    for (const [[ax, ay], [bx, by]] of this.facing(corners)) {
      const across = Math.abs(Math.sin(Math.atan2(by - ay, bx - ax) - this.eye.heading));
      this.side([ax, ay, low, bx, by, low, bx, by, high, ax, ay, high], colour, rim, 0.38 - 0.16 * across);
    }
    this.side(corners.flatMap(([x, y]) => [x, y, high]), colour, rim, 0);
  }

  dot(x: number, y: number, radius: number, colour: string, rim: string | null): void {
    const { g } = this;
    dot(g, colour, x, y, radius);
    if (!rim) return;
    g.strokeStyle = rim;
    g.lineWidth = Math.min(4, Math.max(1, radius * 0.2));
    g.stroke();
  }

  mark([x, y]: readonly number[], radius: number, colour: string, rim: string | null): void {
    if (x !== undefined && y !== undefined) this.dot(x, y, radius, colour, rim);
  }

  glow(spot: readonly number[], radius: number, colour: string): void {
    for (const share of [1, 0.6]) {
      this.g.globalAlpha = 0.25 * this.sheer;
      this.mark(spot, radius * share, colour, null);
    }
    this.g.globalAlpha = this.sheer;
  }
}

/** Positive where the corners go round counter-clockwise. */
function areaOf(corners: readonly Point[]): number {
  return corners.reduce((sum, [ax, ay], k) => {
    const [bx, by] = corners[(k + 1) % corners.length]!;
    return sum + (ax * by - bx * ay) / 2;
  }, 0);
}
