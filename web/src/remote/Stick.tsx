import { useRef, useState, type PointerEvent } from "react";
import { pilot } from "./driving";
import { fingerAxes } from "./handles";
import { STILL, type Axes } from "./pilot";
import { useTexts } from "./texts";
import css from "./remote.module.css";

/** The share of the pad's half that the knob can go. */
const REACH = 0.72;

/** A pad to push in the direction to go; it springs back when it is let go. */
export function Stick() {
  const t = useTexts();
  const pad = useRef<HTMLDivElement>(null);
  const [axes, setAxes] = useState<Axes | null>(null);

  function follow(event: PointerEvent): void {
    const box = pad.current!.getBoundingClientRect();
    const reach = (box.width / 2) * REACH;
    const now = fingerAxes(
      (event.clientX - box.left - box.width / 2) / reach,
      (event.clientY - box.top - box.height / 2) / reach,
    );
    setAxes(now);
    pilot.hold("stick", now);
  }

  function letGo(): void {
    setAxes(null);
    pilot.letGo("stick");
  }

  const { throttle, steering } = axes ?? STILL;
  return (
    <div className={css.stick}>
      <div
        ref={pad}
        className={css.pad}
        data-held={axes !== null || undefined}
        role="application"
        aria-label={t("stick")}
        aria-describedby="stick-about"
        tabIndex={0}
        onPointerDown={(event) => {
          event.currentTarget.setPointerCapture(event.pointerId);
          follow(event);
        }}
        onPointerMove={(event) => axes && follow(event)}
        onPointerUp={letGo}
        onPointerCancel={letGo}
        onLostPointerCapture={letGo}
        onContextMenu={(event) => event.preventDefault()}
      >
        <span className={css.cross} />
        <span
          className={css.knob}
          style={{ left: `${50 + steering * REACH * 50}%`, top: `${50 - throttle * REACH * 50}%` }}
        />
      </div>
      <p id="stick-about" className={css.about}>
        {t("stickAbout")}
      </p>
    </div>
  );
}
