import { type Ref, useEffect, useRef, useState } from "react";
import type { MissionZone } from "../generated/messages";
import { sharpContext, watchSize } from "../ui/areas";
import { type Box, boxOfMat, boxOfPoints, cameraOn, grown } from "./camera";
import { type CarLook, carAt } from "./carLook";
import { watchTheme } from "./colours";
import type { Mat, Point } from "./document";
import { paint, type View, viewOf } from "./painter";
import type { Mark } from "./shapes";
import type { ShownZone } from "./zones";
import css from "./picture.module.css";

const CAR_M = 0.15;
/** A car is as long as this share of its picture at least. */
const CAR_SHARE = 1 / 14;
/** How large the cars of a crowd are, compared with others. */
const CROWD_SIZE = 0.7;

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

interface Shown {
  of: readonly MissionZone[];
  zones: readonly ShownZone[];
  way: readonly Mark[];
}

/** A mat from above, painted as the stage is: a picture that always fits, also of a mission that a teacher wrote. */
export function Picture({ mat, zones = NOTHING, cars, tMs = 0, way = NOTHING, size, onPoint, ref }: PictureProps) {
  const canvas = useRef<HTMLCanvasElement>(null);
  const [look, setLook] = useState(0);
  useEffect(() => watchTheme(() => setLook((before) => before + 1)), []);
  // What was made of these zones and this way last, so that the still layer stays.
  const last = useRef<Shown>({ of: NOTHING, zones: NOTHING, way: NOTHING });
  useEffect(() => {
    const element = canvas.current!;
    const draw = () => {
      const { clientWidth: width, clientHeight: height } = element;
      if (!width || !height) return;
      const box = boxOf(mat, zones);
      const view = viewOf(mat);
      const shown = last.current;
      if (shown.of !== zones) Object.assign(shown, { of: zones, zones: zones.map((zone) => ({ zone, name: null, fits: true })) });
      if (way.length > 1 && shown.way[0]?.way !== way) shown.way = [{ way, widthM: 0.001, leastPx: 2, colour: view.theme.leader, alpha: 0.35 }];
      const carM = Math.max(CAR_M, CAR_SHARE * Math.max(box.right - box.left, (box.top - box.bottom) * 1.6));
      Object.assign(view, { zones: shown.zones, below: shown.way, carM, isDetailed: false, tMs });
      view.cars = cars ? cars.map((car) => lookOf(car, view)) : firstCars(mat, view);
      const context = sharpContext(element, width, height);
      paint(context, view, cameraOn(box, { width, height }), element.width / width);
    };
    draw();
    return watchSize(element, draw);
  }, [mat, zones, cars, tMs, way, look]);
  return (
    <span ref={ref} className={css.frame} style={size} aria-hidden="true" onPointerEnter={() => onPoint?.(true)} onPointerLeave={() => onPoint?.(false)}>
      <canvas ref={canvas} className={css.picture} />
    </span>
  );
}

function lookOf({ at: [x, y], headingDeg, isLeader, led }: PlacedCar, { theme }: View): CarLook {
  return carAt(x, y, (headingDeg * Math.PI) / 180, isLeader, isLeader ? theme.leader : theme.follower, led);
}

/** The cars with which a mat begins; those of a crowd stand evenly, since the picture doesn't know where exactly. */
function firstCars({ car = [], crowd = [], size_m }: Mat, view: View): CarLook[] {
  const crowds = crowd.flatMap(({ corner_m, size_m: size, cars }) =>
    spread(corner_m ?? [0, 0], size ?? size_m ?? [1, 1], cars).map(([x, y]) => ({ ...carAt(x, y, 0, false, view.theme.follower), size: CROWD_SIZE })),
  );
  const placed = car.map(({ at_m, heading_deg = 0, role }) => lookOf({ at: at_m, headingDeg: heading_deg, isLeader: role === "leader" }, view));
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
