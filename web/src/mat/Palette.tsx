import { memo, type PointerEvent, useEffect, useRef, useState } from "react";
import { createPortal } from "react-dom";
import { useTexts } from "../i18n";
import { type NewKind, NEW_KINDS, place } from "./actions";
import { toWorld } from "./camera";
import { Icon } from "../ui/icons";
import { drawRoads, useMat } from "./store";
import css from "./mat.module.css";
import buttons from "../ui/buttons.module.css";
import { classes } from "../ui/classes";

interface Drag {
  kind: NewKind;
  x: number;
  y: number;
}

/** Things to drag onto the mat; a key or a tap puts one in the middle. */
export const Palette = memo(function Palette() {
  const t = useTexts();
  const scene = useMat((now) => now.scene);
  const drawing = useMat((now) => now.drawing);
  const [drag, setDrag] = useState<Drag | null>(null);
  const dragged = useRef(false);

  const drop = (kind: NewKind, event: { clientX: number; clientY: number }) => {
    const box = scene?.host.getBoundingClientRect();
    if (!scene || !box) return;
    const [x, y] = [event.clientX - box.left, event.clientY - box.top];
    if (x < 0 || y < 0 || x > box.width || y > box.height) return;
    place(kind, toWorld(scene.camera, scene.size, x, y));
    scene.host.focus();
  };
  const placeInMiddle = (kind: NewKind) => {
    if (!scene || dragged.current) return;
    place(kind, [scene.camera.x, scene.camera.y]);
    scene.host.focus();
  };
  const take = (kind: NewKind, event: PointerEvent<HTMLButtonElement>) => {
    if (event.button !== 0) return;
    const begin = { x: event.clientX, y: event.clientY };
    const button = event.currentTarget;
    button.setPointerCapture(event.pointerId);
    dragged.current = false;
    button.onpointermove = ({ clientX: x, clientY: y }) => {
      dragged.current ||= Math.hypot(x - begin.x, y - begin.y) > 8;
      if (dragged.current) setDrag({ kind, x, y });
    };
    const end = (up: globalThis.PointerEvent) => {
      button.onpointermove = button.onpointerup = button.onpointercancel = null;
      setDrag(null);
      if (dragged.current && up.type === "pointerup") drop(kind, up);
      // The click that follows belongs to this drag.
      setTimeout(() => (dragged.current = false));
    };
    button.onpointerup = button.onpointercancel = end;
  };
  return (
    <div className={classes("wrap", css.palette)} role="toolbar" aria-label={t("mat.palette")}>
      {NEW_KINDS.map((kind) => (
        <button
          key={kind}
          type="button"
          className={classes(buttons.button, buttons.tool)}
          aria-label={t("mat.add", { what: t(`mat.things.${kind}`) })}
          disabled={!scene}
          onPointerDown={(event) => take(kind, event)}
          onClick={() => placeInMiddle(kind)}
        >
          <Icon name={kind} />
          <span>{t(`mat.things.${kind}`)}</span>
        </button>
      ))}
      <button type="button" className={classes(buttons.button, buttons.tool)} aria-pressed={drawing} disabled={!scene} onClick={() => drawRoads(!drawing)}>
        <Icon name="pencil" />
        <span>{t("mat.drawRoad")}</span>
      </button>
      {drag && <Ghost {...drag} />}
    </div>
  );
});

function Ghost({ kind, x, y }: Drag) {
  useEffect(() => {
    document.body.classList.add(css.carrying!);
    return () => document.body.classList.remove(css.carrying!);
  }, []);
  return createPortal(
    <div className={css.ghost} style={{ left: x, top: y }} aria-hidden="true">
      <Icon name={kind} />
    </div>,
    document.body,
  );
}
