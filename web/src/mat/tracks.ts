/** The paths of all cars, in strips: when there are too many, the oldest strip goes. */

import type { Picture } from "../api/world";

const STEP_M = 0.04;
const LIFTED_M = 1;
const LINES_A_STRIP = 600;
const MOST_STRIPS = 60;

export class Tracks {
  /** Paths of cars, each as x and y of its points, and how dense they are painted. */
  readonly strips: { paths: number[][]; alpha: number }[] = [];
  /** What is painted already stays as long as this stays. */
  version = 0;
  /** The lines that came since the last painting, each as x and y of both ends; whoever paints them empties the list. */
  fresh: number[] = [];
  shown = true;
  private lastX = new Float32Array();
  private lastY = new Float32Array();
  private lastMs = 0;
  /** Which path of the open strip is each car's. */
  private pathOf: (number[] | undefined)[] = [];
  private lines = 0;

  clear(): void {
    this.strips.length = 0;
    this.lastX = this.lastY = new Float32Array();
    this.closeStrip();
  }

  private closeStrip(): void {
    this.pathOf = [];
    this.lines = 0;
    this.fresh = [];
    this.version += 1;
  }

  take(picture: Picture): void {
    if (picture.past || !this.shown) return;
    // A car that moves while time stands still is moved by the user.
    const isMovedByUser = picture.tMs === this.lastMs;
    this.lastMs = picture.tMs;
    if (picture.fresh || isMovedByUser || this.lastX.length !== picture.cars) {
      if (!isMovedByUser) this.clear();
      this.lastX = picture.x.slice();
      this.lastY = picture.y.slice();
      return;
    }
    for (let k = 0; k < picture.cars; k++) this.follow(k, picture.x[k]!, picture.y[k]!);
    if (this.lines < LINES_A_STRIP) return;
    this.closeStrip();
    if (this.strips.length > MOST_STRIPS) this.strips.shift();
    this.strips.forEach((strip, place) => (strip.alpha = 1 - (this.strips.length - place) / (MOST_STRIPS + 4)));
  }

  private follow(k: number, x: number, y: number): void {
    const distance = Math.hypot(x - this.lastX[k]!, y - this.lastY[k]!);
    if (distance < STEP_M) return;
    if (distance < LIFTED_M) this.draw(k, x, y);
    else this.pathOf[k] = undefined;
    this.lastX[k] = x;
    this.lastY[k] = y;
  }

  private draw(k: number, x: number, y: number): void {
    if (this.lines === 0) this.strips.push({ paths: [], alpha: 1 });
    let path = this.pathOf[k];
    if (!path) {
      path = this.pathOf[k] = [this.lastX[k]!, this.lastY[k]!];
      this.strips.at(-1)!.paths.push(path);
    }
    this.fresh.push(path.at(-2)!, path.at(-1)!, x, y);
    path.push(x, y);
    this.lines += 1;
  }
}
