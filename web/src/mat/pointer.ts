/** Mouse, pen and fingers on the mat: drag things, or the mat itself; wheel and two fingers zoom. */

import { panned, toWorld, zoomed } from "./camera";
import type { Point } from "./document";
import type { Grip } from "./pick";
import type { Scene } from "./scene";

export interface Hands {
  gripAt: (point: Point, reachPx: number) => Grip | null;
  onChoose: (grip: Grip | null) => void;
  onDrag: (grip: Grip, to: Point, by: Point) => void;
  onDrop: () => void;
}

const CLICK_PX = 5;
const REACH_PX = { mouse: 6, pen: 10, touch: 18 } as const;
const WHEEL_ZOOM = 0.0015;

interface Finger {
  x: number;
  y: number;
}

export function attachPointers(host: HTMLElement, scene: Scene, hands: Hands): () => void {
  const fingers = new Map<number, Finger>();
  let grip: Grip | null = null;
  let begun: Finger | null = null;
  let dragging = false;
  let last: Point = [0, 0];

  const at = (event: MouseEvent): Finger => {
    const box = host.getBoundingClientRect();
    return { x: event.clientX - box.left, y: event.clientY - box.top };
  };
  const world = ({ x, y }: Finger): Point => toWorld(scene.camera, scene.size, x, y);

  function down(event: PointerEvent) {
    if (event.button !== 0 || !isMat(event)) return;
    host.setPointerCapture(event.pointerId);
    const finger = at(event);
    fingers.set(event.pointerId, finger);
    if (fingers.size > 1) {
      grip = null;
      return;
    }
    begun = finger;
    dragging = false;
    last = world(finger);
    const kind = event.pointerType as keyof typeof REACH_PX;
    grip = hands.gripAt(last, REACH_PX[kind]);
  }

  function move(event: PointerEvent) {
    const before = fingers.get(event.pointerId);
    if (!before) {
      if (isMat(event)) host.style.cursor = hands.gripAt(world(at(event)), REACH_PX.mouse) ? "pointer" : "grab";
      return;
    }
    const finger = at(event);
    if (fingers.size === 2) pinch(event.pointerId, before, finger);
    else if (fingers.size === 1) drag(before, finger);
    fingers.set(event.pointerId, finger);
  }

  function drag(before: Finger, finger: Finger) {
    if (!dragging && begun && Math.hypot(finger.x - begun.x, finger.y - begun.y) < CLICK_PX) return;
    if (!dragging && grip) hands.onChoose(grip);
    dragging = true;
    if (grip) {
      const to = world(finger);
      hands.onDrag(grip, to, [to[0] - last[0], to[1] - last[1]]);
      last = to;
    } else scene.look(panned(scene.camera, finger.x - before.x, finger.y - before.y));
  }

  function pinch(id: number, before: Finger, finger: Finger) {
    dragging = true;
    const other = [...fingers].find(([each]) => each !== id)![1];
    const factor = Math.hypot(finger.x - other.x, finger.y - other.y) / Math.max(1, Math.hypot(before.x - other.x, before.y - other.y));
    const middle = { x: (finger.x + other.x) / 2, y: (finger.y + other.y) / 2 };
    const moved = panned(scene.camera, (finger.x - before.x) / 2, (finger.y - before.y) / 2);
    scene.look(zoomed(moved, scene.size, factor, middle.x, middle.y));
  }

  function up(event: PointerEvent) {
    if (!fingers.delete(event.pointerId) || fingers.size) return;
    if (!dragging && event.type === "pointerup") hands.onChoose(grip);
    else hands.onDrop();
    grip = begun = null;
  }

  function wheel(event: WheelEvent) {
    event.preventDefault();
    const { x, y } = at(event);
    const lines = event.deltaMode === WheelEvent.DOM_DELTA_LINE ? 30 : 1;
    scene.look(zoomed(scene.camera, scene.size, Math.exp(-event.deltaY * lines * WHEEL_ZOOM), x, y));
  }

  const isMat = (event: Event) => event.target instanceof HTMLCanvasElement;
  const ends = new AbortController();
  const { signal } = ends;
  host.addEventListener("pointerdown", down, { signal });
  host.addEventListener("pointermove", move, { signal });
  host.addEventListener("pointerup", up, { signal });
  host.addEventListener("pointercancel", up, { signal });
  host.addEventListener("wheel", wheel, { signal, passive: false });
  return () => ends.abort();
}
