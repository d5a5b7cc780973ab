/** Short runs of examples and blocks, which scripts/clips.py simulates. */

import type { Mat, Point } from "./document";
import type { Placed } from "./Picture";

interface ClipsFile {
  every_ms: number;
  headings: number;
  clips: Record<string, { mat: Mat; moments: number[][] }>;
}

/** A run of an example. */
export interface Clip {
  mat: Mat;
  durationMs: number;
  /** How many cars there are. */
  cars: number;
  /** Where the leader drives. */
  way: Point[];
  /** The cars at a time from 0 to `durationMs`; between two stored moments, on the line from one to the other. */
  at: (tMs: number) => Placed[];
}

/** The numbers of a car in a moment: x and y in centimetres, heading, and LED. */
const NUMBERS = 4;

/** The runs of all examples, by id. */
export async function loadClips(): Promise<ReadonlyMap<string, Clip>> {
  return clipsOf((await import("../generated/clips.json")).default);
}

/** The runs in a file, by name. */
export function clipsOf(file: unknown): ReadonlyMap<string, Clip> {
  const { clips, ...how } = file as ClipsFile;
  return new Map(Object.entries(clips).map(([name, { mat, moments }]) => [name, clipOf(mat, moments, how)]));
}

export function clipOf(mat: Mat, moments: readonly number[][], { every_ms, headings }: Omit<ClipsFile, "clips">): Clip {
  const cars = moments[0]!.length / NUMBERS;
  const leader = mat.car?.findIndex(({ role }) => role === "leader") ?? -1;
  const at = (tMs: number) => {
    const place = Math.min(Math.max(0, tMs / every_ms), moments.length - 1);
    const [now, next] = [moments[Math.floor(place)]!, moments[Math.ceil(place)]!];
    const share = place % 1;
    return Array.from({ length: cars }, (_, k): Placed => {
      const [x, y, heading, led] = now.slice(k * NUMBERS, (k + 1) * NUMBERS) as [number, number, number, number];
      const [x1, y1, heading1] = next.slice(k * NUMBERS, (k + 1) * NUMBERS) as [number, number, number, number];
      // The shorter way round.
      const turn = ((heading1 - heading + headings * 1.5) % headings) - headings / 2;
      return {
        at: [(x + (x1 - x) * share) / 100, (y + (y1 - y) * share) / 100],
        headingDeg: ((heading + turn * share) / headings) * 360,
        isLeader: k === leader,
        led,
      };
    });
  };
  const way = leader < 0 ? [] : moments.map((moment): Point => [moment[leader * NUMBERS]! / 100, moment[leader * NUMBERS + 1]! / 100]);
  return { mat, durationMs: (moments.length - 1) * every_ms, cars, way, at };
}
