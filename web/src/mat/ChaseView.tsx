import { useEffect, useRef } from "react";
import { useTranslation } from "react-i18next";
import { isCalm, sharpContext } from "../ui/areas";
import { shortestTurn } from "./carLayer";
import { ChasePainter } from "./chasePainter";
import { eyeBehind } from "./perspective";
import type { Scene } from "./scene";
import { chasedCar, useMat } from "./store";
import css from "./mat.module.css";

/** In this time the camera turns most of the way that its car has turned. */
const TURN_MS = 260;

/** The stage as seen from behind a car; null while it is seen from above. */
export function ChaseView() {
  const car = useMat(chasedCar);
  const scene = useMat((now) => now.scene);
  return scene && car !== null ? <Chase scene={scene} car={car} /> : null;
}

function Chase({ scene, car }: { scene: Scene; car: number }) {
  const { t } = useTranslation();
  const host = useRef<HTMLCanvasElement>(null);
  const leads = useMat(({ hello }) => hello?.leads?.includes(car) ?? false);

  useEffect(() => {
    const canvas = host.current!;
    const painter = new ChasePainter(canvas.getContext("2d")!);
    let heading: number | null = null;
    let before = performance.now();
    const paint = () => {
      const now = performance.now();
      const sight = scene.sight();
      const { x, y, heading: headings } = sight.drawn;
      if (car >= x.length) return;
      const left = heading === null || isCalm() ? 0 : shortestTurn(headings[car]! - heading);
      // The rest of a turn after this picture.
      const rest = Math.abs(left) < 0.002 ? 0 : left * Math.exp(-Math.min(100, now - before) / TURN_MS);
      heading = headings[car]! - rest;
      before = now;
      sharpContext(canvas, scene.size.width, scene.size.height);
      painter.paint(sight, eyeBehind(x[car]!, y[car]!, heading), scene.size);
      if (rest !== 0) scene.draw();
    };
    const end = scene.listen(paint);
    scene.cover(true);
    return () => {
      end();
      scene.cover(false);
    };
  }, [scene, car]);

  const label = t(leads ? "mat.chasingLeader" : "mat.chasing", { number: car });
  return <canvas className={css.chase} data-part="chase" ref={host} role="img" aria-label={label} />;
}
