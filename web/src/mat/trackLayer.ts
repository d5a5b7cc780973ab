/** Where cars came along: strips of lines that pale with age, the oldest of which go. */

import { Container, Graphics } from "pixi.js";
import type { Picture } from "../api/world";
import type { MatTheme } from "./theme";

const STEP_M = 0.04;
const LIFTED_M = 1;
const LINES_A_STRIP = 600;
const MOST_STRIPS = 60;

export class TrackLayer {
  readonly view = new Container();
  private lastX = new Float32Array();
  private lastY = new Float32Array();
  private lastMs = 0;
  private lines: number[] = [];
  private open: Graphics | null = null;
  shown = true;

  constructor(private theme: MatTheme) {}

  setTheme(theme: MatTheme): void {
    this.theme = theme;
    this.clear();
  }

  clear(): void {
    for (const strip of this.view.removeChildren()) strip.destroy();
    this.lastX = this.lastY = new Float32Array();
    this.lines = [];
    this.open = null;
  }

  take(picture: Picture): void {
    if (picture.past || !this.shown) return;
    // Who moves while time stands still is carried.
    const isCarried = picture.tMs === this.lastMs;
    this.lastMs = picture.tMs;
    if (picture.fresh || isCarried || this.lastX.length !== picture.cars) {
      if (!isCarried) this.clear();
      this.lastX = picture.x.slice();
      this.lastY = picture.y.slice();
      return;
    }
    const before = this.lines.length;
    for (let k = 0; k < picture.cars; k++) this.follow(k, picture.x[k]!, picture.y[k]!);
    if (this.lines.length > before) this.drawStrip();
  }

  private follow(k: number, x: number, y: number): void {
    const distance = Math.hypot(x - this.lastX[k]!, y - this.lastY[k]!);
    if (distance < STEP_M) return;
    if (distance < LIFTED_M) this.lines.push(this.lastX[k]!, this.lastY[k]!, x, y);
    this.lastX[k] = x;
    this.lastY[k] = y;
  }

  private drawStrip(): void {
    this.open ??= this.view.addChild(new Graphics());
    this.open.clear();
    for (let at = 0; at < this.lines.length; at += 4) {
      this.open.moveTo(this.lines[at]! * 1000, this.lines[at + 1]! * 1000);
      this.open.lineTo(this.lines[at + 2]! * 1000, this.lines[at + 3]! * 1000);
    }
    this.open.stroke({ width: 14, color: this.theme.track });
    if (this.lines.length < LINES_A_STRIP * 4) return;
    this.open = null;
    this.lines = [];
    const strips = this.view.children;
    if (strips.length > MOST_STRIPS) this.view.removeChildAt(0).destroy();
    strips.forEach((strip, place) => (strip.alpha = 1 - (strips.length - place) / (MOST_STRIPS + 4)));
  }
}
