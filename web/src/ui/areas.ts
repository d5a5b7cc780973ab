/** Listeners that can be ended, and sharp canvases. */

/** Call back now and whenever the size of an element changes; returns a function that ends this. */
export function watchSize(element: Element, changed: () => void): () => void {
  const observer = new ResizeObserver(changed);
  observer.observe(element);
  return () => observer.disconnect();
}

const CALM = matchMedia("(prefers-reduced-motion: reduce)");

/** Whether the user wants nothing to move by itself. */
export const isCalm = () => CALM.matches;

/** Make a canvas so large, in pixels of the page, and sharp; returns what draws on it by these pixels. */
export function sharpContext(canvas: HTMLCanvasElement, width: number, height: number): CanvasRenderingContext2D {
  const sharpness = Math.min(2, devicePixelRatio);
  const size = { width: Math.round(width * sharpness), height: Math.round(height * sharpness) };
  if (canvas.width !== size.width || canvas.height !== size.height) Object.assign(canvas, size);
  const g = canvas.getContext("2d")!;
  g.setTransform(sharpness, 0, 0, sharpness, 0, 0);
  return g;
}

/** A function that calls all of these: each ends something. */
export const endAll = (...ends: (() => void)[]) => () => ends.forEach((end) => end());

/** Call back at events of these kinds, each of which is what `act` takes; returns a function that ends this. */
export function listen(target: EventTarget, kinds: readonly string[], act: (event: never) => void, capture = false): () => void {
  const listening = new AbortController();
  for (const kind of kinds) target.addEventListener(kind, act as EventListener, { capture, signal: listening.signal });
  return () => listening.abort();
}
