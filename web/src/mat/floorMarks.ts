/** What a floor draws, as shapes in metres that any view can draw. */

import { hexColour } from "./colours";
import type { FloorName, Point } from "./document";
import { type FloorPen, paintFloor } from "./floors";
import { circleAt } from "./perspective";

/** A shape on the floor, in metres. */
export interface Mark {
  corners: number[];
  colour: string;
  alpha: number;
  /** Of a line, in metres; 0 for a filled shape. */
  widthM: number;
}

/** Records what a floor draws, in metres. */
class Recorder implements FloorPen {
  readonly marks: Mark[] = [];
  private shapes: number[][] = [];
  private lines: number[][] = [];

  rect(x: number, y: number, width: number, height: number): this {
    const [left, bottom, right, top] = [x / 1000, y / 1000, (x + width) / 1000, (y + height) / 1000];
    this.shapes.push([left, bottom, 0, right, bottom, 0, right, top, 0, left, top, 0]);
    return this;
  }

  roundRect(x: number, y: number, width: number, height: number): this {
    return this.rect(x, y, width, height);
  }

  circle(x: number, y: number, radius: number): this {
    this.shapes.push(circleAt(x / 1000, y / 1000, radius / 1000));
    return this;
  }

  moveTo(x: number, y: number): this {
    this.lines.push([x / 1000, y / 1000, 0]);
    return this;
  }

  lineTo(x: number, y: number): this {
    this.lines.at(-1)?.push(x / 1000, y / 1000, 0);
    return this;
  }

  fill({ color, alpha = 1 }: { color: number; alpha?: number }): this {
    for (const corners of this.shapes) this.marks.push({ corners, colour: hexColour(color), alpha, widthM: 0 });
    this.shapes = [];
    return this;
  }

  stroke({ width, color, alpha = 1 }: { width: number; color: number; alpha?: number }): this {
    for (const corners of this.lines) this.marks.push({ corners, colour: hexColour(color), alpha, widthM: width / 1000 });
    this.lines = [];
    return this;
  }
}

const GRID_M = 0.25;
const MOST_LINES = 60;

function grid([width, height]: Point, colour: string): Mark[] {
  const step = GRID_M * Math.ceil(Math.max(width, height) / GRID_M / MOST_LINES);
  const lines: number[][] = [];
  for (let x = step; x < width; x += step) lines.push([x, 0, 0, x, height, 0]);
  for (let y = step; y < height; y += step) lines.push([0, y, 0, width, y, 0]);
  return lines.map((corners) => ({ corners, colour, alpha: 1, widthM: 0.005 }));
}

/** The marks of a floor of a size in metres; a plain one has a grid. */
export function marksOf(floor: FloorName, size: Point, gridColour: string, hasRoads: boolean): Mark[] {
  const recorder = new Recorder();
  return paintFloor(recorder, floor, size[0] * 1000, size[1] * 1000, hasRoads) ? recorder.marks : grid(size, gridColour);
}
