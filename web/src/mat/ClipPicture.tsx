/** Short runs of examples and blocks, which scripts/clips.py simulates, and how they are shown. */

import { useEffect, useRef, useState } from "react";
import { isCalm } from "../ui/areas";
import type { Mat, Point } from "./document";
import { Picture, type PlacedCar } from "./Picture";

/** What moves by itself must stop by itself within this time (WCAG 2.2.2). */
const BY_ITSELF_MS = 5_000;
const DRAWN_EVERY_MS = 40;

interface ClipPictureProps {
  clip: Clip;
  /** It moves as long as this is so; else for five seconds when it comes into view, and never where users want calm. */
  moves?: boolean;
  /** In pixels; without it, it fills its place. */
  size?: { width: number; height: number };
}

/** A run from above, that moves. */
export function ClipPicture({ clip, moves: isMoved = false, size }: ClipPictureProps) {
  const [tMs, setTime] = useState(0);
  const [isInView, setInView] = useState(false);
  const [isPointedAt, setPointedAt] = useState(false);
  const moves = isMoved || isPointedAt;
  const frame = useRef<HTMLSpanElement>(null);
  const shown = useRef(0);
  useEffect(() => {
    const observer = new IntersectionObserver(([entry]) => setInView(entry!.isIntersecting), { threshold: 0.6 });
    observer.observe(frame.current!);
    return () => observer.disconnect();
  }, []);
  useEffect(() => {
    if (!(moves || isInView) || isCalm()) return;
    const began = performance.now() - shown.current;
    const until = moves ? Infinity : performance.now() + BY_ITSELF_MS;
    let request = 0;
    const draw = (now: number) => {
      if (now > until) return;
      const at = Math.max(0, now - began) % clip.durationMs;
      if (Math.abs(at - shown.current) >= DRAWN_EVERY_MS) {
        shown.current = at;
        setTime(at);
      }
      request = requestAnimationFrame(draw);
    };
    request = requestAnimationFrame(draw);
    return () => cancelAnimationFrame(request);
  }, [clip, moves, isInView]);
  return <Picture ref={frame} mat={clip.mat} cars={clip.at(tMs)} tMs={tMs} way={clip.way} size={size} onPoint={setPointedAt} />;
}

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
  at: (tMs: number) => PlacedCar[];
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
    return Array.from({ length: cars }, (_, k): PlacedCar => {
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
