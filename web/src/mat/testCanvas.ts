/** A canvas for tests, which paints nothing and tells what was asked of it. */

import { vi } from "vitest";

/** What was filled, stroked, written or drawn, with the colour and alpha that it had then. */
export interface Painted {
  what: "fill" | "stroke" | "fillRect" | "fillText" | "drawImage";
  args: readonly unknown[];
  colour: unknown;
  alpha: number;
  /** The points of the path. */
  path: readonly (readonly [number, number])[];
  /** The transform's angle and shift. */
  transform: readonly number[];
}

const TOLD = ["fill", "stroke", "fillRect", "fillText", "drawImage"];

/** A context that lists what is painted on a canvas of a size. */
export function testContext(width: number, height: number, painted: Painted[] = []): CanvasRenderingContext2D {
  let path: [number, number][] = [];
  let transform: readonly number[] = [];
  const state: Record<string, unknown> = { canvas: { width, height }, globalAlpha: 1, measureText: (text: string) => ({ width: 7 * text.length }) };
  const acts: Record<string, (...args: number[]) => void> = {
    beginPath: () => (path = []),
    moveTo: (x, y) => path.push([x, y]),
    lineTo: (x, y) => path.push([x, y]),
    arc: (x, y) => path.push([x, y]),
    setTransform: (...to) => (transform = to),
  };
  return new Proxy(state, {
    get: (own, key: string): unknown => {
      if (key in own) return own[key];
      if (!TOLD.includes(key)) return acts[key] ?? (() => ({ addColorStop: () => undefined }));
      return (...args: unknown[]) => {
        const colour = key === "stroke" ? own.strokeStyle : own.fillStyle;
        painted.push({ what: key as Painted["what"], args, colour, alpha: own.globalAlpha as number, path, transform });
      };
    },
  }) as unknown as CanvasRenderingContext2D;
}

/** Give each canvas of the page a context; what is painted on all of them comes into one list. */
export function watchCanvases(): Painted[] {
  const painted: Painted[] = [];
  vi.spyOn(HTMLCanvasElement.prototype, "getContext").mockImplementation(function (this: HTMLCanvasElement) {
    return testContext(this.width, this.height, painted) as never;
  } as never);
  return painted;
}
