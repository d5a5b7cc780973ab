import { Button, Input, Label, Link, NumberField } from "react-aria-components";
import { useTranslation } from "react-i18next";
import type { CompiledWord } from "../api/types";
import { type CarDetails, type LossReason, LOSS_REASONS } from "../api/world";
import { useStudio } from "../state/studio";
import { bitsOf, colourOf, groupOf } from "../words/bits";
import { fieldMeaning } from "../words/meaning";
import { duplicateChosen, removeChosen, turnCar } from "./actions";
import { colourWords, hexColour } from "./colours";
import { heardText } from "./heard";
import { PieceInspector, Voices } from "./PieceInspector";
import type { Session } from "./session";
import { choose, useMat } from "./store";
import { ToolButton, ToolSwitch } from "./fields";
import fields from "./fields.module.css";
import css from "./mat.module.css";
import buttons from "../ui/buttons.module.css";
import { classes } from "../ui/classes";

const TURN_DEG = 15;

interface InspectorProps {
  session: Session;
  words: readonly CompiledWord[];
}

export function Inspector({ session, words }: InspectorProps) {
  const { t } = useTranslation();
  const chosen = useMat((now) => now.chosen);
  const car = chosen && "car" in chosen ? chosen.car : null;
  return (
    <div className={css.inspector}>
      <div className={css.row}>
        <CarPicker session={session} car={car} />
        {chosen && (
          <>
            <ToolButton icon="copy" label={t("mat.duplicate")} onPress={() => duplicateChosen(session)} />
            <ToolButton icon="trash" label={t("mat.remove")} onPress={() => removeChosen(session)} />
          </>
        )}
      </div>
      <Held session={session} car={car} />
      {car !== null && <CarInspector session={session} car={car} words={words} />}
      <PieceInspector />
      <Voices />
    </div>
  );
}

function CarPicker({ session, car }: { session: Session; car: number | null }) {
  const { t } = useTranslation();
  const cars = useMat(({ hello }) => hello?.cars ?? 0);
  const pick = (number: number) => {
    choose({ car: Math.min(cars - 1, Math.max(0, number)) });
    session.watch();
  };
  return (
    <div className={css.row}>
      <ToolButton icon="left" label={t("mat.previousCar")} isDisabled={!cars} onPress={() => pick((car ?? 1) - 1)} />
      <NumberField
        className={classes(fields.field, fields.beside)}
        value={car ?? NaN}
        minValue={0}
        maxValue={Math.max(0, cars - 1)}
        isDisabled={!cars}
        onChange={(number) => !Number.isNaN(number) && pick(number)}
      >
        <Label>{t("mat.carNumber")}</Label>
        <Input />
      </NumberField>
      <ToolButton icon="right" label={t("mat.nextCar")} isDisabled={!cars} onPress={() => pick((car ?? -1) + 1)} />
    </div>
  );
}

function CarInspector({ session, car, words }: InspectorProps & { car: number }) {
  const { t } = useTranslation();
  const details = useMat((now) => now.details);
  const followed = useMat((now) => now.followed);
  const leads = useMat(({ hello }) => hello?.leads?.includes(car) ?? false);
  return (
    <section aria-label={t("mat.car", { number: car })}>
      <div className={css.row}>
        <h3>
          {t("mat.car", { number: car })} · {leads ? t("mat.things.leader") : t("mat.things.follower")}
        </h3>
        <ToolSwitch label={t("mat.follow")} isSelected={followed} onChange={(on) => useMat.setState({ followed: on })} />
        <ToolButton icon="turnLeft" label={t("mat.turnLeft")} onPress={() => turnCar(session, car, TURN_DEG)} />
        <ToolButton icon="turnRight" label={t("mat.turnRight")} onPress={() => turnCar(session, car, -TURN_DEG)} />
        <Link className={classes(buttons.button, buttons.small)} href={`/drive?session=${session.name}&car=${car}`} target="_blank">
          {t("mat.drive")}
        </Link>
      </div>
      <Place />
      {details?.car === car && <Details details={details} words={words} />}
    </section>
  );
}

const NONE: readonly number[] = [];
const MOST_NAMED = 12;

/** The cars that were driven by hand and wait; a button lets the chosen one continue its program. */
function Held({ session, car }: { session: Session; car: number | null }) {
  const { t } = useTranslation();
  const held = useMat(({ state }) => state?.held ?? NONE);
  if (!held.length) return null;
  const named = held.slice(0, MOST_NAMED).join(", ") + (held.length > MOST_NAMED ? " …" : "");
  return (
    <p >
      {t("mat.held", { cars: named })}{" "}
      {car !== null && held.includes(car) && (
        <Button className={classes(buttons.button, buttons.small)} onPress={() => session.send({ do: "resume", car })}>
          {t("mat.resume")}
        </Button>
      )}
    </p>
  );
}

/** Where the chosen car is, as a text for those who can't see the mat. */
function Place() {
  const { t } = useTranslation();
  const pose = useMat((now) => now.pose);
  if (!pose) return null;
  const metres = (value: number) => value.toFixed(2);
  return <p >{t("mat.place", { x: metres(pose.x_m), y: metres(pose.y_m), heading: pose.heading_deg })}</p>;
}

function Details({ details, words }: { details: CarDetails; words: readonly CompiledWord[] }) {
  const { t } = useTranslation();
  const { word, values, hears, lost } = details;
  const losses = LOSS_REASONS.filter((why): why is Exclude<LossReason, ""> => why !== "").filter((why) => lost[why]);
  const colour = word === null ? undefined : colourWords(words).byWord.get(parseInt(word, 16));
  return (
    <>
      <p className={css.word}>
        <span className={css.swatch} style={{ background: colour === undefined ? "var(--quiet)" : hexColour(colour) }} />
        {word === null ? t("mat.noWord") : <code>{word.toUpperCase()}</code>}
        {word !== null && <span>{details.runs ? t("mat.runs", { count: details.index }) : t("mat.over")}</span>}
      </p>
      {word !== null && values && <Fields hex={word} values={values} leads={details.leads} />}
      <dl className={css.counters}>
        <Counter title={t("mat.sent")} count={details.frames} />
        <Counter title={t("mat.heard")} count={details.heard} />
        {losses.map((why) => (
          <Counter key={why} title={t(`mat.lost.${why}`)} count={lost[why] ?? 0} />
        ))}
      </dl>
      {hears && (
        <p>{heardText(hears)}</p>
      )}
    </>
  );
}

function Counter({ title, count }: { title: string; count: number }) {
  return (
    <div>
      <dt>{title}</dt>
      <dd>{count}</dd>
    </div>
  );
}

interface FieldsProps {
  hex: string;
  values: Record<string, number>;
  leads: boolean;
}

function Fields({ hex, values, leads }: FieldsProps) {
  const { formats, profileFigures } = useStudio();
  if (!formats || !profileFigures) return null;
  const word: CompiledWord = { hex, values, part: leads ? "leader" : "followers", block: null };
  const shown = formats.control.filter(({ name }) => groupOf(name) !== "reserved" && groupOf(name) !== "parity");
  return (
    <ul className={css.fields}>
      {shown.map((field) => (
        <li key={field.name} data-set={(values[field.name] ?? 0) !== 0 || undefined}>
          <code style={{ background: colourOf(field.name) }}>{bitsOf(word, field)}</code>
          <span>{fieldMeaning(word, field, profileFigures)}</span>
        </li>
      ))}
    </ul>
  );
}
