/** What a car tells: why it does what it does, in the drawer and on the stage, and there its word, beside a car that was tapped. */

import { useEffect, useRef, useState } from "react";
import type { CompiledWord } from "../api/types";
import { type CarDetails, Flag, NO_INDEX } from "../api/world";
import { inLanguage, useTexts } from "../i18n";
import { useStudio, useWords } from "../state/studio";
import { IconButton, TextButton } from "../ui/controls";
import { storyOf } from "../words/story";
import { WordBits } from "../words/WordBits";
import { toggleBits } from "./actions";
import { toScreen } from "./camera";
import { carryOut, changesBlocks, remedyOf } from "./remedies";
import { useShown } from "./useShown";
import { chasedCar, choose, chosenCar, useMat } from "./store";
import css from "./mat.module.css";

/** The answer, and a button that changes it. It is about the present. */
export function WhyAnswer({ details }: { details: CarDetails }) {
  const t = useTexts();
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
        <TextButton small onPress={() => void carryOut(details.car, details.why)}>{t(`mat.remedies.${remedy}`)}</TextButton>
      )}
    </p>
  );
}

/** Between the card and the edges of the stage, and what plays at its foot. */
const AIR_PX = 6;
const FOOT_PX = 76;

/** The word that a car holds at the moment that is shown; null where it holds none, or one that is not the program's. */
function useWordOf(car: number | null): CompiledWord | null {
  const words = useWords();
  const index = useShown((picture) => {
    const runs = picture && car !== null && picture.flags[car]! & Flag.runs;
    return runs ? picture.index[car]! : NO_INDEX;
  });
  return words[index] ?? null;
}

/** What a car told when it was asked: words follow each other too fast for a screen reader. */
function Announced({ text }: { text: string }) {
  const [first] = useState(text);
  return (
    <p className="unseen" role="status">
      {first}
    </p>
  );
}

/** What the car that was tapped tells: beside it, and whole within the stage. */
export function CarCard() {
  const t = useTexts();
  const scene = useMat((now) => now.scene);
  const asked = useMat((now) => now.asked);
  const car = useMat((now) => now.asked && chosenCar(now));
  const details = useMat((now) => (now.details?.car === car && !now.past ? now.details : null));
  const leads = useMat(({ hello }) => car !== null && (hello?.leads?.includes(car) ?? false));
  const chased = useMat((now) => chasedCar(now) !== null);
  const profile = useStudio((studio) => studio.profileFigures);
  const word = useWordOf(car);
  const card = useRef<HTMLElement>(null);
  const told = word && profile ? t("mat.says", { word: storyOf(word, profile) }) : t("mat.saysNothing");
  useEffect(() => {
    if (!scene || car === null || chased) return;
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
    return scene.listen(place);
  }, [scene, car, chased]);
  if (car === null || chased || !profile) return null;
  return (
    <section ref={card} className={css.why} aria-label={t("mat.car", { number: car })}>
      <Announced key={`${car} ${asked}`} text={told} />
      <header className="row apart">
        <b>
          {t("mat.car", { number: car })} · {t(leads ? "mat.things.leader" : "mat.things.follower")}
        </b>
        <IconButton icon="close" label={t("app.dismiss")} onPress={() => choose(null)} />
      </header>
      <p className="strong">{told}</p>
      {asked === "bits" && word && <WordBits word={word} profile={profile} />}
      {asked === "story" && details && <WhyAnswer details={details} />}
      {word && (
        <TextButton link onPress={toggleBits}>
          {t(asked === "story" ? "mat.showBits" : "mat.hideBits")}
        </TextButton>
      )}
    </section>
  );
}
