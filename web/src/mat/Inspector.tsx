import { Link } from "react-aria-components";
import type { CompiledWord } from "../api/types";
import { type CarDetails, type LossReason, LOSS_REASONS, NO_INDEX } from "../api/world";
import { FORMATS } from "../generated/steps";
import { CarStops } from "../certainty/StopTools";
import { say, useTexts } from "../i18n";
import { useStudio, useWords } from "../state/studio";
import { bitsOf, colourOf, fieldMeaning, isTold } from "../words/bits";
import { valueOf } from "../words/values";
import { duplicateChosen, removeChosen, turnCar } from "./actions";
import { colourOfWord, colourWords } from "./colours";
import { lastFrameText } from "./Narration";
import { Palette } from "./Palette";
import { PieceInspector, Voices } from "./PieceInspector";
import { session } from "./session";
import { choose, chosenCar, useMat } from "./store";
import { NumberBox, ToolButton, ToolSwitch } from "../ui/fields";
import { WhyAnswer } from "./Why";
import css from "./mat.module.css";
import buttons from "../ui/buttons.module.css";
import { classes } from "../ui/classes";
import { TextButton } from "../ui/controls";

export function Inspector() {
  const t = useTexts();
  const chosen = useMat((now) => now.chosen);
  const car = useMat(chosenCar);
  const inMission = useStudio(({ mission }) => mission !== null);
  return (
    <div className={css.inspector}>
      {inMission ? <p>{t("missions.matStays")}</p> : <Palette />}
      <div className="wrap">
        <CarPicker car={car} />
        {chosen && !inMission && (
          <>
            <ToolButton icon="copy" label={t("mat.duplicate")} onPress={duplicateChosen} />
            <ToolButton icon="trash" label={t("mat.remove")} onPress={removeChosen} />
          </>
        )}
      </div>
      <DrivenCars car={car} />
      {car !== null && <CarInspector car={car} />}
      {!inMission && (
        <>
          <PieceInspector />
          <Voices />
        </>
      )}
    </div>
  );
}

function CarPicker({ car }: { car: number | null }) {
  const t = useTexts();
  const cars = useMat(({ hello }) => hello?.cars ?? 0);
  const pick = (number: number) => choose({ car: Math.min(cars - 1, Math.max(0, number)) });
  return (
    <div className="wrap">
      <ToolButton icon="left" label={t("mat.previousCar")} isDisabled={!cars} onPress={() => pick((car ?? 1) - 1)} />
      <NumberBox label={t("mat.carNumber")} value={car ?? NaN} minValue={0} maxValue={Math.max(0, cars - 1)} isDisabled={!cars} onChange={pick} />
      <ToolButton icon="right" label={t("mat.nextCar")} isDisabled={!cars} onPress={() => pick((car ?? -1) + 1)} />
    </div>
  );
}

function CarInspector({ car }: { car: number }) {
  const t = useTexts();
  const details = useMat((now) => now.details);
  const followed = useMat((now) => now.followed);
  const chase = useMat((now) => now.chase);
  const leads = useMat(({ hello }) => hello?.leads?.includes(car) ?? false);
  const inMission = useStudio(({ mission }) => mission !== null);
  const canDrive = useStudio(({ capabilities }) => capabilities?.driving ?? false);
  return (
    <section className="stack" aria-label={t("mat.car", { number: car })}>
      <div className="wrap">
        <h3>
          {t("mat.car", { number: car })} · {leads ? t("mat.things.leader") : t("mat.things.follower")}
        </h3>
        <ToolSwitch label={t("mat.follow")} isSelected={followed} onChange={(on) => useMat.setState({ followed: on })} />
        {!inMission && (
          <>
            <ToolButton icon="turnLeft" label={t("mat.turnLeft")} onPress={() => turnCar(car, 1)} />
            <ToolButton icon="turnRight" label={t("mat.turnRight")} onPress={() => turnCar(car, -1)} />
          </>
        )}
        <ToolSwitch label={t("mat.chase")} isSelected={chase} onChange={(on) => useMat.setState({ chase: on })} />
        {canDrive && (
          <Link className={classes(buttons.button, buttons.small)} href={`/drive?session=${session.name}&car=${car}`} target="_blank">
            {t("mat.drive")}
          </Link>
        )}
      </div>
      <CarStops car={car} />
      <Place />
      {details?.car === car && <Details details={details} />}
    </section>
  );
}

const NONE: readonly number[] = [];
const MOST_NAMED = 12;

/** The cars that somebody drives or drove; a button lets the chosen one continue its program. */
function DrivenCars({ car }: { car: number | null }) {
  const t = useTexts();
  const driven = useMat(({ state }) => state?.driven ?? NONE);
  // They are those of the present.
  const past = useMat((now) => now.past);
  if (!driven.length || past) return null;
  const named = driven.slice(0, MOST_NAMED).join(", ") + (driven.length > MOST_NAMED ? " …" : "");
  return (
    <p>
      {t("mat.driven", { cars: named })}{" "}
      {car !== null && driven.includes(car) && (
        <TextButton small onPress={() => session.send({ do: "resume", car })}>{t("mat.resume")}</TextButton>
      )}
    </p>
  );
}

/** Where the chosen car is, as a text for those who can't see the mat. */
function Place() {
  const t = useTexts();
  const pose = useMat((now) => now.pose);
  if (!pose) return null;
  const metres = (value: number) => value.toFixed(2);
  return <p>{t("mat.place", { x: metres(pose.x_m), y: metres(pose.y_m), heading: pose.heading_deg })}</p>;
}

function Details({ details }: { details: CarDetails }) {
  const words = useWords();
  const t = useTexts();
  const { word, values, last_frame: last, lost } = details;
  const losses = LOSS_REASONS.filter((why): why is Exclude<LossReason, ""> => why !== "").filter((why) => lost[why]);
  return (
    <>
      <p className="wrap">
        <span className={css.swatch} style={{ background: colourOfWord(colourWords(words), word ?? "") ?? "var(--quiet)" }} />
        {word === null ? t("mat.noWord") : <code>{word.toUpperCase()}</code>}
        {word !== null && <span>{wordText(details)}</span>}
      </p>
      {word !== null && values && <Fields hex={word} leads={details.leads} />}
      <dl className={css.counters}>
        <Counter title={t("mat.sent")} count={details.frames} />
        <Counter title={t("mat.heard")} count={details.heard} />
        {losses.map((why) => (
          <Counter key={why} title={t(`mat.lost.${why}`)} count={lost[why] ?? 0} />
        ))}
      </dl>
      <WhyAnswer details={details} />
      {last && <p>{lastFrameText(last)}</p>}
    </>
  );
}

/** Whether the word runs, and which of the program's it is; one that was damaged on the way is none of them. */
function wordText({ runs, index }: CarDetails): string {
  if (!runs) return say("mat.over");
  return index === NO_INDEX ? say("mat.runsOther") : say("mat.runs", { count: index });
}

function Counter({ title, count }: { title: string; count: number }) {
  return (
    <div>
      <dt className="quiet small">{title}</dt>
      <dd>{count}</dd>
    </div>
  );
}

/** What the bits of a word say. */
function Fields({ hex, leads }: { hex: string; leads: boolean }) {
  const profileFigures = useStudio((studio) => studio.profileFigures);
  if (!profileFigures) return null;
  const word: CompiledWord = { hex, part: leads ? "leader" : "followers", block: null };
  const shown = FORMATS.control.filter(isTold);
  return (
    <ul className={css.fields}>
      {shown.map((field) => (
        <li key={field.name} data-set={valueOf(word, field.name) !== 0 || undefined}>
          <code style={{ background: colourOf(field) }}>{bitsOf(word, field)}</code>
          <span>{fieldMeaning(word, field, profileFigures)}</span>
        </li>
      ))}
    </ul>
  );
}
