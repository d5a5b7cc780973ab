/** Where conditions are chosen: for the chosen car, a thing, a zone; and that the world has stopped. */

import type { MissionZone } from "../generated/messages";
import { inLanguage, useTexts } from "../i18n";
import type { PieceId } from "../mat/document";
import { ToolButton } from "../ui/fields";
import { session } from "../mat/session";
import { choose, useMat } from "../mat/store";
import { useMission } from "../missions/store";
import { openDrawer } from "../state/settings";
import { clock } from "../timeline/events";
import { IconButton, TextButton } from "../ui/controls";
import { addStop, CAR_KINDS, nameOf, removeStop, useStops, zoneStop } from "./stops";
import mat from "../mat/mat.module.css";
import css from "./certainty.module.css";

/** Stop when something happens to this car. */
export function CarStops({ car }: { car: number }) {
  const t = useTexts();
  return (
    <div className="wrap" role="group" aria-label={t("stops.when")}>
      <b>{t("stops.when")}</b>
      {CAR_KINDS.map((kind) => (
        <ToolButton key={kind} icon="stop" wide label={t(`stops.${kind}`, { who: t("stops.it") })} onPress={() => addStop({ condition: { kind, car } })} />
      ))}
    </div>
  );
}

const SOLID = ["wall", "disc", "polygon"] as const;

/** Stop when a car touches this thing; nothing for what no car can touch. */
export function PieceStop({ piece }: { piece: PieceId }) {
  const t = useTexts();
  const thing = SOLID.find((each) => each === piece.kind);
  if (!thing) return null;
  const stop = { condition: { kind: "touch", thing, number: piece.place } as const };
  return <ToolButton icon="stop" wide label={t("stops.whenTouched")} onPress={() => addStop(stop)} />;
}

/** The zone that was tapped, and that the world can stop when a car enters it. */
export function ZoneCard() {
  const t = useTexts();
  const zone = useStops((now) => now.zone);
  if (!zone) return null;
  const close = () => useStops.setState({ zone: null });
  return (
    <p className={mat.notice}>
      <b>{inLanguage(zone.title)}</b>
      <TextButton
        small
        onPress={() => {
          addStop(zoneStop(zone));
          close();
        }}
      >
        {t("stops.whenEntered")}
      </TextButton>
      <IconButton icon="close" label={t("app.dismiss")} onPress={close} />
    </p>
  );
}

/** Says on the stage why the world has stopped. */
export function StoppedNotice() {
  const t = useTexts();
  const stopped = useMat((now) => now.stopped);
  const show = (car: number) => {
    choose({ car });
    openDrawer("timeline");
  };
  return (
    <div role="status">
      {stopped && (
        <p className={mat.notice}>
          <span>{t("stops.stopped", { time: clock(stopped.t_ms), why: inLanguage(stopped.why) })}</span>
          <TextButton small onPress={() => show(stopped.car)}>{t("stops.look")}</TextButton>
          <TextButton small primary onPress={() => session.play()}>{t("stops.goOn")}</TextButton>
        </p>
      )}
    </div>
  );
}

const NO_ZONES: readonly MissionZone[] = [];

/** All that the world stops on, and what any car may do; what a thing, a zone or a block does is chosen there. */
export function StopList() {
  const t = useTexts();
  const stops = useStops((now) => now.stops);
  const zones = useMission(({ mission }) => mission?.zones ?? NO_ZONES);
  return (
    <section className={css.part} aria-label={t("stops.title")}>
      <h3>{t("stops.title")}</h3>
      <p className="quiet">{t("stops.how")}</p>
      <div className="wrap">
        {CAR_KINDS.map((kind) => (
          <ToolButton key={kind} icon="plus" wide label={t(`stops.${kind}`, { who: t("stops.anyCar") })} onPress={() => addStop({ condition: { kind } })} />
        ))}
      </div>
      {zones.length > 0 && (
        <div className="wrap">
          {zones.map((zone) => (
            <ToolButton key={zone.name} icon="plus" wide label={nameOf(zoneStop(zone))} onPress={() => addStop(zoneStop(zone))} />
          ))}
        </div>
      )}
      <ul className="wrap" aria-label={t("stops.chosen")}>
        {stops.map((stop, place) => (
          <li key={place} className={css.stop}>
            <span>{nameOf(stop)}</span>
            <IconButton icon="close" label={t("stops.remove", { what: nameOf(stop) })} onPress={() => removeStop(place)} />
          </li>
        ))}
      </ul>
    </section>
  );
}
