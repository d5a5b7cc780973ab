import type { Ref } from "react";
import type { MissionZone } from "../generated/messages";
import { type Box, boxOfMat, boxOfPoints, grown } from "./camera";
import { hexColour, LEDS } from "./colours";
import { floorOf, type Mat, personAt, type Point } from "./document";
import { groundOf } from "./floors";
import { roadMarks } from "./marks";
import css from "./picture.module.css";

const CAR_M = 0.15;

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
  ref?: Ref<SVGSVGElement>;
}

/** A mat from above, drawn from its data: a picture that always fits, also of a mission that a teacher wrote. */
export function Picture({ mat, zones = [], cars, tMs = 0, way = [], size: sizePx, onPoint, ref }: PictureProps) {
  const { left, bottom, right, top } = boxOf(mat, zones);
  const size = Math.max(right - left, (top - bottom) * 1.6);
  const car = Math.max(CAR_M, size / 16);
  const points = (corners: readonly (readonly number[])[]) => corners.map(([x, y]) => `${x},${-y!}`).join(" ");
  return (
    <svg
      ref={ref}
      className={sizePx ? undefined : css.picture}
      {...sizePx}
      viewBox={`${left} ${-top} ${right - left} ${top - bottom}`}
      aria-hidden="true"
      onPointerEnter={() => onPoint?.(true)}
      onPointerLeave={() => onPoint?.(false)}
    >
      {mat.size_m && <rect className={css.floor} style={{ fill: groundOf(floorOf(mat)) }} x={0} y={-mat.size_m[1]} width={mat.size_m[0]} height={mat.size_m[1]} />}
      {roadMarks(mat).map(({ way: middle, widthM, colour }, k) =>
        widthM ? (
          <polyline key={k} className={css.road} stroke={colour} strokeWidth={widthM} points={points(middle)} />
        ) : (
          <polygon key={k} fill={colour} points={points(middle)} />
        ),
      )}
      {zones.map(({ name, corners_m, centre_m, radius_m }) =>
        centre_m ? (
          <circle key={name} className={css.zone} cx={centre_m[0]} cy={-centre_m[1]!} r={radius_m!} />
        ) : (
          <polygon key={name} className={css.zone} points={points(corners_m)} />
        ),
      )}
      {mat.polygon?.map(({ corners_m }, k) => <polygon key={k} className={css.thing} points={points(corners_m)} />)}
      {mat.disc?.map(({ centre_m: [x, y], radius_m }, k) => <circle key={k} className={css.thing} cx={x} cy={-y} r={radius_m} />)}
      {mat.wall?.map(({ from_m, to_m }, k) => (
        <line key={k} className={css.wall} x1={from_m[0]} y1={-from_m[1]} x2={to_m[0]} y2={-to_m[1]} />
      ))}
      {mat.person?.map((person, k) => {
        const [x, y] = personAt(person, tMs);
        return <circle key={k} className={css.somebody} cx={x} cy={-y} r={car / 2} />;
      })}
      {way.length > 1 && <polyline className={css.way} points={points(way)} />}
      {!cars &&
        mat.crowd?.flatMap((crowd, k) =>
          spread(crowd.corner_m ?? [0, 0], crowd.size_m ?? mat.size_m ?? [1, 1], crowd.cars).map(([x, y], at) => (
            <circle key={`${k} ${at}`} className={css.follower} cx={x} cy={-y} r={car / 3} />
          )),
        )}
      {(cars ?? mat.car?.map(placed))?.map(({ at: [x, y], headingDeg, isLeader, led = LEDS.length }, k) => (
        <g key={k} transform={`translate(${x} ${-y}) rotate(${-headingDeg})`}>
          <path className={isLeader ? css.leader : css.follower} d={`M${car / 2} 0L${-car / 2} ${-car / 2.6}V${car / 2.6}z`} />
          {LEDS[led] !== undefined && (
            <g fill={hexColour(LEDS[led])}>
              <circle className={css.glow} r={car * 0.7} />
              <circle cx={-car / 6} r={car / 5} />
            </g>
          )}
        </g>
      ))}
    </svg>
  );
}

function placed({ at_m, heading_deg = 0, role }: NonNullable<Mat["car"]>[number]): PlacedCar {
  return { at: at_m, headingDeg: heading_deg, isLeader: role === "leader" };
}

/** The box around what is there, with some air. */
function boxOf(mat: Mat, zones: readonly MissionZone[]): Box {
  const corners = zones.flatMap(({ corners_m, centre_m }) => (centre_m ? [centre_m] : corners_m));
  const points = [...corners, ...(mat.car ?? []).map(({ at_m }) => at_m)];
  return boxOfMat(mat) ?? grown(boxOfPoints(points) ?? { left: 0, bottom: 0, right: 0, top: 0 }, 0.5);
}

/** As many points as there are cars, evenly over an area; the picture doesn't know where exactly they stand. */
function spread([left, bottom]: Point, [width, height]: Point, cars: number): Point[] {
  const columns = Math.max(1, Math.round(Math.sqrt((cars * width) / height)));
  const rows = Math.ceil(cars / columns);
  return Array.from({ length: cars }, (_, k) => [
    left + ((k % columns) + 0.5) * (width / columns),
    bottom + (Math.floor(k / columns) + 0.5) * (height / rows),
  ]);
}
