import { useEffect, useRef } from "react";
import { useTexts } from "../i18n";
import { useStudio } from "../state/studio";
import { askWhy } from "./actions";
import { freePlace } from "./bubbles";
import { toScreen } from "./camera";
import { chasedCar, useMat } from "./store";
import css from "./mat.module.css";
import { classes } from "../ui/classes";

/** What cars think, above them: the service says it. The caption tells screen readers what happens. */
export function Thoughts() {
  const t = useTexts();
  const scene = useMat((now) => now.scene);
  const thoughts = useMat((now) => now.thoughts);
  const host = useRef<HTMLDivElement>(null);
  const chased = useMat((now) => chasedCar(now) !== null);
  // A program with a wrong block is none for the cars, though there are blocks.
  const isWrong = useStudio(({ compiled }) => compiled?.diagnostics.some(({ severity }) => severity === "error") ?? false);

  useEffect(() => {
    if (!scene) return;
    const place = () => {
      const { drawn } = scene.motion;
      const taken = scene.nameBoxes();
      thoughts.forEach(({ car }, at) => {
        const bubble = host.current?.children[at] as HTMLElement | undefined;
        if (!bubble || car >= drawn.x.length) return;
        const [x, y] = toScreen(scene.camera, scene.size, [drawn.x[car]!, drawn.y[car]!]);
        const inView = x > 0 && y > 0 && x < scene.size.width && y < scene.size.height;
        const { offsetWidth: width, offsetHeight: height } = bubble;
        // A bubble at the stage's edge is moved until all of it can be read.
        const left = Math.min(Math.max(x - width / 2, 4), Math.max(4, scene.size.width - width - 4));
        const away = scene.carPx * 0.65;
        // Above the car, or else below it.
        const boxes = [y - away - height, y + away].map((top) => new DOMRect(left, top, width, height));
        const box = inView ? freePlace(boxes, taken) : undefined;
        if (box) taken.push(box);
        bubble.style.visibility = box ? "visible" : "hidden";
        bubble.style.translate = `${left.toFixed(1)}px ${(box ?? boxes[0]!).y.toFixed(1)}px`;
        bubble.style.setProperty("--tip", `${(x - left).toFixed(1)}px`);
        bubble.toggleAttribute("data-below", box === boxes[1]);
      });
    };
    return scene.listen(place);
  }, [scene, thoughts, chased]);

  if (chased) return null;
  return (
    <div className={classes("cover clip through", css.thoughts)} ref={host} aria-hidden="true">
      {thoughts.map(({ car, thought }) => (
        <p key={car} data-car={car} onClick={() => askWhy(car)}>
          {t(`mat.thoughts.${thought === "noProgram" && isWrong ? "wrongProgram" : thought}`)}
        </p>
      ))}
    </div>
  );
}
