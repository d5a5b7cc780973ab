/** Draw the lanes: words as bars, and below them frames as ticks of different heights and colours. */

import { readInks } from "../mat/colours";
import { clock, type EventStore, type Lane, Mark, packLane, ticksOf, type Window } from "./events";

export const LANE_PX = 34;
export const AXIS_PX = 22;
const BAR = { top: 4, height: 14 };
const TICKS = { top: 20, height: 11 };

const INKS = { text: "--text", quiet: "--quiet", line: "--line", panel: "--panel", accent: "--accent", heard: "--success", lost: "--error" } as const;
type Look = Record<keyof typeof INKS | "font", string>;

interface TimelineView {
  window: Window;
  nowMs: number;
  shownMs: number;
  /** The numbers of the cars from top to bottom, and how many pixels of the first lane are hidden by scrolling. */
  cars: readonly number[];
  offsetPx: number;
  chosen: number | null;
  colourOf: (word: number) => string;
  /** What is written where events are no longer stored. */
  forgotten: string;
}

export const lookOf = (element: HTMLElement): Look => ({ ...readInks(element, INKS), font: getComputedStyle(element).fontFamily });

export function paint(g: CanvasRenderingContext2D, width: number, height: number, view: TimelineView, store: EventStore, look: Look) {
  g.fillStyle = look.panel;
  g.fillRect(0, 0, width, height);
  const x = (ms: number) => ((ms - view.window.beginMs) / (view.window.endMs - view.window.beginMs)) * width;
  paintAxis(g, width, height, view.window, x, look);
  g.save();
  g.beginPath();
  g.rect(0, AXIS_PX, width, height - AXIS_PX);
  g.clip();
  view.cars.forEach((car, row) => {
    const top = AXIS_PX + row * LANE_PX - view.offsetPx;
    if (car === view.chosen) tint(g, look.accent, top, width, LANE_PX);
    const lane = packLane(store.of(car), view.window, view.nowMs, Math.max(1, Math.floor(width)));
    paintSpans(g, lane, top, x, view.colourOf);
    paintMarks(g, lane.marks, top, look);
    paintDecisions(g, lane, top, x, look);
    g.fillStyle = look.line;
    g.fillRect(0, top + LANE_PX - 1, width, 1);
  });
  paintForgotten(g, x(Math.min(store.forgottenUntilMs, view.window.endMs)), height, view.forgotten, look);
  g.restore();
  paintMoment(g, x(view.shownMs), height, look);
}

function tint(g: CanvasRenderingContext2D, colour: string, y: number, width: number, height: number) {
  g.globalAlpha = 0.12;
  g.fillStyle = colour;
  g.fillRect(0, y, width, height);
  g.globalAlpha = 1;
}

/** Lanes are empty there, though something may have happened. */
function paintForgotten(g: CanvasRenderingContext2D, end: number, height: number, text: string, look: Look) {
  if (end <= 0) return;
  tint(g, look.text, AXIS_PX, end, height - AXIS_PX);
  g.fillStyle = look.quiet;
  g.fillText(text, 8, AXIS_PX + LANE_PX / 2, Math.max(0, end - 16));
}

function paintAxis(g: CanvasRenderingContext2D, width: number, height: number, window: Window, x: (ms: number) => number, look: Look) {
  const { atMs, stepMs } = ticksOf(window, width);
  g.font = `11px ${look.font}`;
  g.textBaseline = "middle";
  for (const at of atMs) {
    const left = Math.round(x(at));
    g.fillStyle = look.line;
    g.fillRect(left, AXIS_PX - 5, 1, height);
    g.fillStyle = look.quiet;
    g.fillText(clock(at, stepMs < 1000), left + 4, AXIS_PX / 2);
  }
  g.fillStyle = look.line;
  g.fillRect(0, AXIS_PX - 1, width, 1);
}

function paintSpans(g: CanvasRenderingContext2D, lane: Lane, top: number, x: (ms: number) => number, colourOf: TimelineView["colourOf"]) {
  for (const { beginMs, endMs, word } of lane.spans) {
    const left = x(beginMs);
    g.fillStyle = colourOf(word);
    g.beginPath();
    g.roundRect(left, top + BAR.top, Math.max(1.5, x(endMs) - left - 1), BAR.height, 3);
    g.fill();
  }
}

function paintMarks(g: CanvasRenderingContext2D, marks: Uint8Array, top: number, look: Look) {
  const { top: begin, height } = TICKS;
  marks.forEach((mark, column) => {
    if (mark & Mark.frame) bar(g, look.accent, column, top + begin + height - 3, 3);
    if (mark & Mark.heard) bar(g, look.heard, column, top + begin + 3, height - 6);
    if (mark & Mark.lost) bar(g, look.lost, column, top + begin, height);
  });
}

/** A diamond for each decision, filled where a condition was followed; a triangle for what was told. */
function paintDecisions(g: CanvasRenderingContext2D, { decisions }: Lane, top: number, x: (ms: number) => number, look: Look) {
  const middle = top + BAR.top + BAR.height / 2;
  for (const { tMs, what } of decisions) {
    const at = x(tMs);
    const shape = what === "told" ? [[-5, -5], [6, 0], [-5, 5]] : [[-5, 0], [0, -6], [5, 0], [0, 6]];
    g.beginPath();
    for (const [aside, down] of shape) g.lineTo(at + aside!, middle + down!);
    g.closePath();
    g.fillStyle = what === "passed" ? look.panel : look.text;
    g.strokeStyle = what === "passed" ? look.text : look.panel;
    g.lineWidth = 1.5;
    g.fill();
    g.stroke();
  }
}

function bar(g: CanvasRenderingContext2D, colour: string, x: number, y: number, height: number) {
  g.fillStyle = colour;
  g.fillRect(x, y, 1, height);
}

function paintMoment(g: CanvasRenderingContext2D, x: number, height: number, look: Look) {
  g.fillStyle = look.accent;
  g.fillRect(Math.round(x) - 1, 0, 2, height);
  g.beginPath();
  g.moveTo(x - 6, 0);
  g.lineTo(x + 6, 0);
  g.lineTo(x, 9);
  g.fill();
}
