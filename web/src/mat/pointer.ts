/** Mouse, pen and fingers on the mat: find what lies under them, drag it or the mat itself, and zoom. */

import { endAll, listen } from "../ui/areas";
import { toWorld } from "./camera";
import { panned, zoomed } from "./framing";
import { FURNITURE, handlesOf, listOf, type Mat, personAt, pieceOf, type Piece, type PieceId, type Point } from "./document";
import type { Drawn } from "./motion";
import { ROAD_M } from "./marks";
import { distanceToPiece } from "./room";
import { distance } from "./ways";
import type { Scene } from "./scene";
import type { Chosen } from "./store";

export type Grip = { car: number } | { piece: PieceId } | { piece: PieceId; handle: number };

export interface OnStage {
  mat: Mat;
  drawn: Drawn;
  radiusM: number;
  chosen: Chosen;
  tMs: number;
}

/** What is within `reach` metres of a point: first the chosen piece's handles, then cars, then the topmost piece. */
export function gripAt(sight: OnStage, point: Point, reach: number): Grip | null {
  const { mat, chosen } = sight;
  if (chosen && "piece" in chosen) {
    const handle = handleAt(mat, chosen.piece, point, reach);
    if (handle >= 0) return { piece: chosen.piece, handle };
  }
  const car = carAt(sight, point, reach);
  if (car !== null) return { car };
  for (const kind of FURNITURE.toReversed()) {
    const place = listOf(mat, kind).findLastIndex((piece) => distanceTo(piece, point, sight.tMs) <= reach);
    if (place >= 0) return { piece: { kind, place } };
  }
  return null;
}

function handleAt(mat: Mat, id: PieceId, point: Point, reach: number): number {
  const piece = pieceOf(mat, id);
  return piece ? handlesOf(piece).findIndex((each) => distance(each, point) <= reach) : -1;
}

function carAt({ drawn, radiusM }: OnStage, [x, y]: Point, reach: number): number | null {
  let nearest: number | null = null;
  let least = Math.max(radiusM, reach);
  for (let k = 0; k < drawn.x.length; k++) {
    const away = Math.hypot(drawn.x[k]! - x, drawn.y[k]! - y);
    if (away > least) continue;
    nearest = k;
    least = away;
  }
  return nearest;
}

const NUDGE_M = 0.05;
const FINE_NUDGE_M = 0.01;
const ARROWS: Record<string, Point> = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };

/** How far an arrow key moves what is chosen, in metres: less with Shift; null for another key. */
export function nudgeOf({ key, shiftKey }: { key: string; shiftKey: boolean }): Point | null {
  const arrow = ARROWS[key];
  const far = shiftKey ? FINE_NUDGE_M : NUDGE_M;
  return arrow ? [arrow[0] * far, arrow[1] * far] : null;
}

const PERSON_M = 0.2;

function distanceTo(piece: Piece, point: Point, tMs: number): number {
  if ("path" in piece) return distance(personAt(piece, tMs), point) - PERSON_M;
  return distanceToPiece(piece, point) - ("points_m" in piece ? ROAD_M / 2 : 0);
}

interface PointerActions {
  gripAt: (point: Point, reachPx: number) => Grip | null;
  /** What was tapped, or will be dragged, and where. */
  onChoose: (grip: Grip | null, at: Point) => void;
  onDrag: (grip: Grip, to: Point, by: Point) => void;
  onDrop: () => void;
  /** Whether a drag draws instead. */
  isDrawing: () => boolean;
  onStroke: (stroke: readonly Point[]) => void;
}

const CLICK_PX = 5;
const REACH_PX = { mouse: 6, pen: 10, touch: 18 } as const;
const WHEEL_ZOOM = 0.0015;

interface Finger {
  x: number;
  y: number;
}

export function attachPointers(host: HTMLElement, scene: Scene, actions: PointerActions): () => void {
  const fingers = new Map<number, Finger>();
  let grip: Grip | null = null;
  let begun: Finger | null = null;
  let dragging = false;
  let stroke: Point[] | null = null;
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
      sketch(null);
      return;
    }
    begun = finger;
    dragging = false;
    last = world(finger);
    if (actions.isDrawing()) {
      sketch([last]);
      return;
    }
    const kind = event.pointerType as keyof typeof REACH_PX;
    grip = actions.gripAt(last, REACH_PX[kind]);
  }

  function move(event: PointerEvent) {
    const before = fingers.get(event.pointerId);
    if (!before) {
      if (actions.isDrawing()) host.style.cursor = "crosshair";
      else if (isMat(event)) host.style.cursor = actions.gripAt(world(at(event)), REACH_PX.mouse) ? "pointer" : "grab";
      return;
    }
    const finger = at(event);
    if (stroke) sketch([...stroke, world(finger)]);
    else if (fingers.size === 2) pinch(event.pointerId, before, finger);
    else if (fingers.size === 1) drag(before, finger);
    fingers.set(event.pointerId, finger);
  }

  function drag(before: Finger, finger: Finger) {
    if (!dragging && begun && Math.hypot(finger.x - begun.x, finger.y - begun.y) < CLICK_PX) return;
    if (!dragging && grip) actions.onChoose(grip, last);
    dragging = true;
    if (grip) {
      const to = world(finger);
      actions.onDrag(grip, to, [to[0] - last[0], to[1] - last[1]]);
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

  function sketch(points: Point[] | null) {
    stroke = points;
    scene.sketch(points);
  }

  function up(event: PointerEvent) {
    if (!fingers.delete(event.pointerId) || fingers.size) return;
    if (stroke) {
      const drawn = stroke;
      sketch(null);
      if (event.type === "pointerup") actions.onStroke(drawn);
      begun = null;
      return;
    }
    if (!dragging && event.type === "pointerup") actions.onChoose(grip, last);
    else actions.onDrop();
    grip = begun = null;
  }

  function wheel(event: WheelEvent) {
    event.preventDefault();
    const { x, y } = at(event);
    const lines = event.deltaMode === WheelEvent.DOM_DELTA_LINE ? 30 : 1;
    scene.look(zoomed(scene.camera, scene.size, Math.exp(-event.deltaY * lines * WHEEL_ZOOM), x, y));
  }

  const isMat = (event: Event) => event.target instanceof HTMLCanvasElement;
  return endAll(
    listen(host, ["pointerdown"], down),
    listen(host, ["pointermove"], move),
    listen(host, ["pointerup", "pointercancel"], up),
    listen(host, ["wheel"], wheel),
  );
}
