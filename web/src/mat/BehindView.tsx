import { useEffect, useRef } from "react";
import { useTexts } from "../i18n";
import { endAll, isCalm, sharpContext } from "../ui/areas";
import { eyeBehind, paintBehind } from "./behind";
import { shortestTurn } from "./motion";
import type { Scene } from "./scene";
import { chasedCar, useMat } from "./store";

/** In this time the camera turns most of the way that its car has turned. */
const TURN_MS = 260;

/** The stage as seen from behind a car; null while it is seen from above. */
export function BehindView() {
  const car = useMat(chasedCar);
  const scene = useMat((now) => now.scene);
  return scene && car !== null ? <Behind scene={scene} car={car} /> : null;
}

function Behind({ scene, car }: { scene: Scene; car: number }) {
  const t = useTexts();
  const host = useRef<HTMLCanvasElement>(null);
  const leads = useMat(({ hello }) => hello?.leads?.includes(car) ?? false);

  useEffect(() => {
    const canvas = host.current!;
    let heading: number | null = null;
    let before = performance.now();
    const paint = () => {
      const now = performance.now();
      const { x, y, heading: headings } = scene.motion.drawn;
      if (car >= x.length) return;
      const left = heading === null || isCalm() ? 0 : shortestTurn(headings[car]! - heading);
      // The rest of a turn after this picture.
      const rest = Math.abs(left) < 0.002 ? 0 : left * Math.exp(-Math.min(100, now - before) / TURN_MS);
      heading = headings[car]! - rest;
      before = now;
      const { width, height } = scene.size;
      paintBehind(sharpContext(canvas, width, height), scene.view, eyeBehind(x[car]!, y[car]!, heading), scene.size);
      if (rest !== 0) scene.draw();
    };
    const end = scene.listen(paint);
    scene.cover(true);
    return endAll(end, () => scene.cover(false));
  }, [scene, car]);

  const label = t(leads ? "mat.chasingLeader" : "mat.chasing", { number: car });
  return <canvas className="cover whole" data-part="chase" ref={host} role="img" aria-label={label} />;
}
