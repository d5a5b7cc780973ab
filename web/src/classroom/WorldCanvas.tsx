import { useEffect, useLayoutEffect, useRef, useState } from "react";
import type { WallWorld } from "../generated/classroom";
import type { Box } from "../mat/camera";
import { readInks } from "../mat/colours";
import { watchSize } from "../ui/areas";
import { boxOf, type Cars, drawWorld, INKS } from "./drawing";

interface CanvasProps {
  world: WallWorld;
  /** What its cars show; undefined before the first picture. */
  cars: Cars | undefined;
  className: string | undefined;
  label: string;
  /** What stands above a car, if anything. */
  nameOf?: (car: number) => string | undefined;
}

/** A world on a canvas, as large as there is room. */
export function WorldCanvas({ world, cars, className, label, nameOf }: CanvasProps) {
  const canvas = useRef<HTMLCanvasElement>(null);
  const box = useRef<Box | null>(null);
  const [{ width, height }, setSize] = useState({ width: 300, height: 150 });
  useEffect(() => {
    const element = canvas.current!;
    return watchSize(element, () =>
      setSize({ width: Math.round(element.clientWidth * devicePixelRatio), height: Math.round(element.clientHeight * devicePixelRatio) }),
    );
  }, []);
  useLayoutEffect(() => {
    const element = canvas.current!;
    const context = element.getContext("2d");
    if (!context) return;
    box.current = boxOf(world, cars, box.current);
    drawWorld(context, { width, height }, { world, cars, box: box.current, inks: readInks(element, INKS) }, nameOf);
  }, [world, cars, nameOf, width, height]);
  return <canvas ref={canvas} className={className} width={width} height={height} role="img" aria-label={label} />;
}
