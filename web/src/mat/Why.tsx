/** Why a car does what it does: in the drawer, and on the stage beside a car that was tapped. */

import { useEffect, useRef } from "react";
import { Button } from "react-aria-components";
import { useTranslation } from "react-i18next";
import type { CarDetails } from "../api/world";
import { inLanguage } from "../i18n";
import { useStudio } from "../state/studio";
import { classes } from "../ui/classes";
import { IconButton } from "../ui/controls";
import { toScreen } from "./camera";
import { carryOut, changesBlocks, remedyOf } from "./remedies";
import { chasedCar, choose, useMat } from "./store";
import buttons from "../ui/buttons.module.css";
import css from "./mat.module.css";

/** The answer, and a button that changes it. It is about the present. */
export function WhyAnswer({ details }: { details: CarDetails }) {
  const { t } = useTranslation();
  const past = useMat((now) => now.past);
  // A mission's mat and range are fixed; the program is the pupil's.
  const inMission = useStudio(({ mission }) => mission !== null);
  const named = remedyOf(details.why);
  const remedy = inMission && named && !changesBlocks(named) ? null : named;
  if (past) return null;
  return (
    <p>
      <b>{t("mat.why")}</b> {inLanguage(details.why.sentence)}{" "}
      {remedy && (
        <Button className={classes(buttons.button, buttons.small)} onPress={() => void carryOut(details.car, details.why)}>
          {t(`mat.remedies.${remedy}`)}
        </Button>
      )}
    </p>
  );
}

/** Between the card and the edges of the stage, and what plays at its foot. */
const AIR_PX = 6;
const FOOT_PX = 76;

/** The answer of the car that was tapped, beside it and whole within the stage. */
export function WhyCard() {
  const { t } = useTranslation();
  const scene = useMat((now) => now.scene);
  const details = useMat(({ asked, details, past }) => (asked && !past ? details : null));
  const chased = useMat((now) => chasedCar(now) !== null);
  const card = useRef<HTMLElement>(null);
  const car = details?.car;
  useEffect(() => {
    if (!scene || car === undefined || chased) return;
    const place = () => {
      const { x, y } = scene.motion.drawn;
      const box = card.current;
      if (!box || car >= x.length) return;
      const [left, top] = toScreen(scene.camera, scene.size, [x[car]!, y[car]!]);
      const within = (at: number, most: number) => Math.max(AIR_PX, Math.min(at, most - AIR_PX));
      const below = top + scene.carPx * 0.7;
      const room = scene.size.height - FOOT_PX - box.offsetHeight;
      const at = below <= room ? below : top - scene.carPx * 0.7 - box.offsetHeight;
      box.style.translate = `${within(left - box.offsetWidth / 2, scene.size.width - box.offsetWidth)}px ${within(at, room)}px`;
    };
    place();
    return scene.listen(place);
  }, [scene, car, chased]);
  if (!details || chased) return null;
  return (
    <section ref={card} className={css.why} aria-label={t("mat.car", { number: details.car })}>
      <header>
        <b>{t("mat.car", { number: details.car })}</b>
        <IconButton icon="close" label={t("app.dismiss")} onPress={() => choose(null)} />
      </header>
      <WhyAnswer details={details} />
    </section>
  );
}
