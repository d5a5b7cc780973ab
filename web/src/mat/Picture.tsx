import { type Ref, useEffect, useMemo, useRef, useSyncExternalStore } from "react";
import type { MissionZone } from "../generated/messages";
import { sharpContext, watchSize } from "../ui/areas";
import { type Box, boxOfMat, boxOfPoints, cameraOn, grown } from "./camera";
import { type CarLook, carAt } from "./carLook";
import { watchTheme } from "./colours";
import type { Mat, Point } from "./document";
import { lookOf } from "./floors";
import { paint, type View, viewOf } from "./painter";
import { line } from "./shapes";
import type { ShownZone } from "./zones";

/** A car is as long as this share of its picture at least. */
const CAR_SHARE = 1 / 14;
/** How large the cars of a crowd are, compared with others. */
const CROWD_SIZE = 0.7;
/** A hair: the way is 2 pixels wide. */
const WAY_M = 0.001;

/** A car at one moment. */
export interface PlacedCar {
  at: Point;
  headingDeg: number;
  isLeader: boolean;
  /** The number of the LED that is on. */
  led?: number;
}

interface PictureProps {
  mat: Mat;
  zones?: readonly MissionZone[];
  /** The cars of a moment; without them, those with which the mat begins. */
  cars?: readonly PlacedCar[];
  tMs?: number;
  /** Where the leader drives. */
  way?: readonly Point[];
  /** In pixels; without it, the picture fills its place. */
  size?: { width: number; height: number };
  /** The pointer comes, or goes. */
  onPoint?: (isThere: boolean) => void;
  ref?: Ref<HTMLSpanElement>;
}

const NOTHING: readonly never[] = [];

/** A mat from above, painted as the stage is: a picture that always fits, also of a mission that a teacher wrote. */
export function Picture({ mat, zones = NOTHING, cars, tMs = 0, way = NOTHING, size, onPoint, ref }: PictureProps) {
  const canvas = useRef<HTMLCanvasElement>(null);
  const theme = useSyncExternalStore(watchTheme, () => lookOf(mat).theme);
  // The still layer stays as long as these are the same objects.
  const shownZones = useMemo(() => zones.map((zone): ShownZone => ({ zone, name: null, fits: true })), [zones]);
  const wayMarks = useMemo(() => (way.length > 1 ? [{ ...line(way, WAY_M, theme.leader, 0.35), leastPx: 2 }] : []), [way, theme]);
  useEffect(() => {
    const element = canvas.current!;
    const draw = () => {
      const { clientWidth: width, clientHeight: height } = element;
      if (!width || !height) return;
      const box = boxOf(mat, zones);
      const view = viewOf(mat);
      const carM = Math.max(view.carM, CAR_SHARE * Math.max(box.right - box.left, (box.top - box.bottom) * 1.6));
      Object.assign(view, { zones: shownZones, below: wayMarks, carM, isDetailed: false, tMs });
      view.cars = cars ? cars.map((car) => carOf(car, view)) : firstCars(mat, view);
      const context = sharpContext(element, width, height);
      paint(context, view, cameraOn(box, { width, height }), element.width / width);
    };
    draw();
    return watchSize(element, draw);
  }, [mat, zones, shownZones, cars, tMs, wayMarks]);
  return (
    <span ref={ref} className="whole" style={size} aria-hidden="true" onPointerEnter={() => onPoint?.(true)} onPointerLeave={() => onPoint?.(false)}>
      <canvas ref={canvas} className="whole" />
    </span>
  );
}

function carOf({ at: [x, y], headingDeg, isLeader, led }: PlacedCar, { theme }: View): CarLook {
  return carAt(x, y, (headingDeg * Math.PI) / 180, isLeader, isLeader ? theme.leader : theme.follower, led);
}

/** The cars with which a mat begins; those of a crowd stand evenly, since the picture doesn't know where exactly. */
function firstCars({ car = [], crowd = [], size_m }: Mat, view: View): CarLook[] {
  const crowds = crowd.flatMap(({ corner_m, size_m: size, cars }) =>
    spread(corner_m ?? [0, 0], size ?? size_m ?? [1, 1], cars).map(([x, y]) => ({ ...carAt(x, y, 0, false, view.theme.follower), size: CROWD_SIZE })),
  );
  const placed = car.map(({ at_m, heading_deg = 0, role }) => carOf({ at: at_m, headingDeg: heading_deg, isLeader: role === "leader" }, view));
  return [...crowds, ...placed];
}

/** The box around what is there, with some air. */
function boxOf(mat: Mat, zones: readonly MissionZone[]): Box {
  const corners = zones.flatMap(({ corners_m, centre_m }) => (centre_m ? [centre_m] : corners_m));
  const points = [...corners, ...(mat.car ?? []).map(({ at_m }) => at_m)];
  return boxOfMat(mat) ?? grown(boxOfPoints(points) ?? { left: 0, bottom: 0, right: 0, top: 0 }, 0.5);
}

/** As many points as there are cars, evenly over an area. */
function spread([left, bottom]: Point, [width, height]: Point, cars: number): Point[] {
  const columns = Math.max(1, Math.round(Math.sqrt((cars * width) / height)));
  const rows = Math.ceil(cars / columns);
  return Array.from({ length: cars }, (_, k) => [
    left + ((k % columns) + 0.5) * (width / columns),
    bottom + (Math.floor(k / columns) + 0.5) * (height / rows),
  ]);
}
