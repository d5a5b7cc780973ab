import { useEffect, useRef, useState } from "react";
import { useTexts } from "../i18n";
import { useStudio } from "../state/studio";
import { endAll } from "../ui/areas";
import { toScreen } from "./camera";
import { session } from "./session";
import { askWhy } from "./actions";
import { chasedCar, useMat } from "./store";
import { seesDark } from "./room";
import { followsLine } from "../words/story";
import { freePlace, type Thought, thoughtsAt } from "./thoughts";
import css from "./mat.module.css";

const EVERY_MS = 400;
/** To compare each car with all others takes too long for more. */
const MOST_CARS = 200;
const BEFORE_MS = 1000;

/** Short sentences above the cars that have a reason to think. The caption tells screen readers what happens. */
export function Thoughts() {
  const t = useTexts();
  const scene = useMat((now) => now.scene);
  const [thoughts, setThoughts] = useState<{ car: number; thought: Thought }[]>([]);
  const host = useRef<HTMLDivElement>(null);
  const chased = useMat((now) => chasedCar(now) !== null);
  // A program with a wrong block is none for the cars, though there are blocks.
  const isWrong = useStudio(({ compiled }) => compiled?.diagnostics.some(({ severity }) => severity === "error") ?? false);

  useEffect(() => {
    let told = "[]";
    // Only what is new: until it draws the thoughts again, React keeps each update that it is told of.
    const tell = (now: { car: number; thought: Thought }[]) => {
      if (JSON.stringify(now) === told) return;
      told = JSON.stringify(now);
      setThoughts(now);
    };
    let past: { tMs: number; x: Float32Array; y: Float32Array }[] = [];
    const look = () => {
      const { picture } = session;
      const { hello } = useMat.getState();
      if (!picture || !hello || picture.cars > MOST_CARS) {
        tell([]);
        return;
      }
      const { rangeMm, mat, compiled, profileFigures } = useStudio.getState();
      const now = thoughtsAt({
        picture,
        leads: new Set(hello.leads),
        rangeM: rangeMm === null ? (hello.range_m ?? 1) : rangeMm / 1000,
        radiusM: hello.radius_m ?? 0.075,
        missesLine: (car) => {
          const word = compiled?.words[picture.index[car]!];
          return word !== undefined && profileFigures !== null && followsLine(word, profileFigures) && !seesDark(mat, picture, car);
        },
        eventsOf: (car) => session.events.of(car),
        knownFromMs: session.events.knownFromMs,
        before: past[0] ?? null,
      });
      tell(now);
    };
    const end = session.listen(({ tMs, x, y, fresh, past: scrubbed }) => {
      if (fresh || scrubbed) past = [];
      const last = past.at(-1);
      if (!scrubbed && (!last || tMs - last.tMs >= EVERY_MS / 2)) past = [...past.filter((each) => tMs - each.tMs <= BEFORE_MS), { tMs, x, y }];
      // What is told has to be true of each picture; what comes to be true is told a little later.
      if (told !== "[]" || fresh || scrubbed || !last) look();
    });
    const timer = setInterval(look, EVERY_MS);
    return endAll(end, () => clearInterval(timer));
  }, []);

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
    <div className={css.thoughts} ref={host} aria-hidden="true">
      {thoughts.map(({ car, thought }) => (
        <p key={car} data-car={car} onClick={() => askWhy(car)}>
          {t(`mat.thoughts.${thought === "noProgram" && isWrong ? "wrongProgram" : thought}`)}
        </p>
      ))}
    </div>
  );
}
