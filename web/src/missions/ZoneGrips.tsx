import { type KeyboardEvent, type PointerEvent, useEffect, useRef } from "react";
import { useTexts } from "../i18n";
import { toScreen, toWorld } from "../mat/camera";
import type { Point } from "../mat/document";
import { nudgeOf } from "../mat/pointer";
import type { Scene } from "../mat/scene";
import { useMat } from "../mat/store";
import { endEdit } from "../state/history";
import { Icon } from "../ui/icons";
import { boxOf, type Draft, editDraft, reshapedZone, stretchedZone, useDraft } from "./draft";
import css from "./missions.module.css";

/** The zones of the mission that is written have two grips each on the stage: one moves the zone, one stretches it. */
export function ZoneGrips() {
  const t = useTexts();
  const draft = useDraft((now) => now.draft);
  const scene = useMat((now) => now.scene);
  if (!draft || !scene) return null;
  return (
    <div className="cover clip through" role="group" aria-label={t("missions.zones")}>
      {draft.zones.flatMap((_, place) =>
        (["move", "stretch"] as const).map((action) => (
          <Grip key={`${place} ${action}`} scene={scene} draft={draft} place={place} action={action} />
        )),
      )}
    </div>
  );
}

/** At the zone's upper left corner the grip that moves it, at the lower right corner the one that stretches it. */
function Grip({ scene, draft, place, action }: { scene: Scene; draft: Draft; place: number; action: "move" | "stretch" }) {
  const t = useTexts();
  const button = useRef<HTMLButtonElement>(null);
  /** From the pointer to the grip's place while it is dragged, in metres. */
  const held = useRef<Point>([0, 0]);
  const zone = draft.zones[place]!;
  const [left, bottom, width, height] = boxOf(zone);
  const [x, y]: Point = action === "move" ? [left, bottom + height] : [left + width, bottom];

  useEffect(() => {
    const follow = () => {
      const [right, down] = toScreen(scene.camera, scene.size, [x, y]);
      if (button.current) button.current.style.translate = `calc(${right.toFixed(1)}px - 50%) calc(${down.toFixed(1)}px - 50%)`;
    };
    return scene.listen(follow);
  }, [scene, x, y]);

  const bring = (to: Point) => {
    const changed = action === "move" ? reshapedZone(zone, { left: to[0], bottom: to[1] - height }) : stretchedZone(zone, to);
    editDraft({ zones: draft.zones.map((each, k) => (k === place ? changed : each)) }, `${action} zone ${place}`);
  };
  const pointAt = (event: PointerEvent): Point => {
    const room = scene.host.getBoundingClientRect();
    return toWorld(scene.camera, scene.size, event.clientX - room.left, event.clientY - room.top);
  };
  const take = (event: PointerEvent<HTMLButtonElement>) => {
    event.currentTarget.setPointerCapture(event.pointerId);
    const at = pointAt(event);
    held.current = [x - at[0], y - at[1]];
  };
  const drag = (event: PointerEvent<HTMLButtonElement>) => {
    if (!event.currentTarget.hasPointerCapture(event.pointerId)) return;
    const at = pointAt(event);
    bring([at[0] + held.current[0], at[1] + held.current[1]]);
  };
  const press = (event: KeyboardEvent) => {
    const nudge = nudgeOf(event);
    if (!nudge) return;
    event.preventDefault();
    bring([x + nudge[0], y + nudge[1]]);
  };
  return (
    <button
      ref={button}
      type="button"
      className={css.grip}
      aria-label={t(action === "move" ? "missions.moveZone" : "missions.stretchZone", { name: zone.name })}
      onPointerDown={take}
      onPointerMove={drag}
      onPointerUp={endEdit}
      onPointerCancel={endEdit}
      onKeyDown={press}
    >
      <Icon name={action === "move" ? "move" : "stretch"} />
    </button>
  );
}
