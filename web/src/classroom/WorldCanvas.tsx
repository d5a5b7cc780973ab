import { useCallback, useEffect, useRef } from "react";
import type { WallWorld } from "../generated/classroom";
import { watchLanguage } from "../i18n";
import type { Box } from "../mat/camera";
import { watchTheme } from "../mat/colours";
import { endAll, watchSize } from "../ui/areas";
import { classes } from "../ui/classes";
import { boxOf, type Cars, drawWorld, type Tiles } from "./drawing";

export interface CanvasProps {
  world: WallWorld;
  label: string;
  /** What its cars show comes by these, under the world's pupil. */
  tiles: Tiles;
  /** What stands above a car, if anything. */
  nameOf?: (car: number) => string | undefined;
  className?: string;
}

/** A world on a canvas, as large as there is room. */
export function WorldCanvas({ world, label, tiles, nameOf, className }: CanvasProps) {
  const canvas = useRef<HTMLCanvasElement>(null);
  const box = useRef<Box | null>(null);
  const last = useRef<Cars | undefined>(undefined);
  const draw = useCallback(
    (cars?: Cars) => {
      const element = canvas.current;
      const context = element?.getContext("2d");
      if (!element || !context) return;
      last.current = cars ?? last.current;
      box.current = boxOf(world, last.current, box.current);
      drawWorld(context, { world, cars: last.current, box: box.current }, nameOf, devicePixelRatio);
    },
    [world, nameOf],
  );
  useEffect(() => {
    const element = canvas.current!;
    return watchSize(element, () => {
      element.width = Math.round(element.clientWidth * devicePixelRatio);
      element.height = Math.round(element.clientHeight * devicePixelRatio);
      draw();
    });
  }, [draw]);
  useEffect(() => {
    tiles.ready(world.pupil, draw);
    draw();
    return () => tiles.ready(world.pupil, null);
  }, [draw, tiles, world.pupil]);
  useEffect(() => endAll(watchLanguage(() => draw()), watchTheme(() => draw())), [draw]);
  return <canvas ref={canvas} className={classes("whole", className)} role="img" aria-label={label} />;
}
