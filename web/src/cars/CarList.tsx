/** The cars that the server finds, live: which answers, what it holds; blink one, load those that are ticked, stop all. */

import { useEffect, useRef, useState } from "react";
import { LastingStream, openSocket } from "../api/connection";
import type { CarRow, CarsAnswer, CarsOrder, CarsShown, Sentence } from "../generated/messages";
import { inLanguage, type KeyIn, useTexts } from "../i18n";
import { Icon } from "../ui/icons";
import { Action, Problem, Tick } from "../ui/page";
import { classes } from "../ui/classes";
import css from "./cars.module.css";

interface CarListProps {
  /** Of the server's WebSocket, such as /api/cars. */
  path: string;
  /** The image to load; empty where the page has none yet, null where its blocks are wrong. */
  image: string | null;
  /** The name of its project. */
  program: string;
  /** Whether the page has another button that stops all cars. */
  stopsElsewhere?: boolean;
}

/** The cars, as the server sends them; `null` before the first. `order` sends an order. */
function useCars(path: string) {
  const [shown, setShown] = useState<CarsShown | null>(null);
  const [problem, setProblem] = useState<Sentence | null>(null);
  const [open, setOpen] = useState(true);
  const stream = useRef<LastingStream<CarsAnswer> | null>(null);
  useEffect(() => {
    const made = new LastingStream<CarsAnswer>((listeners) => openSocket(path, listeners), {
      onOpen: () => setOpen(true),
      onClose: () => setOpen(false),
      onAnswer: (answer) => (answer.is === "cars" ? setShown(answer) : setProblem(answer.sentence)),
    });
    stream.current = made;
    made.reopen();
    return () => made.close();
  }, [path]);
  const order = (what: CarsOrder) => {
    setProblem(null);
    stream.current?.send(what);
  };
  return { shown, problem, open, order };
}

const VERDICTS: Record<string, KeyIn<"cars">> = { away: "missed", new: "new", old: "old" };

/** What a car's upload came to, in words; null where there was none. */
function verdictKey(car: CarRow): KeyIn<"cars"> | null {
  if (car.sent !== null) return "loading";
  return car.holds === "" ? null : (VERDICTS[car.holds] ?? "unknown");
}

export function CarList({ path, image, program, stopsElsewhere = false }: CarListProps) {
  const t = useTexts("cars");
  const { shown, problem, open, order } = useCars(path);
  const [ticked, setTicked] = useState<ReadonlySet<string>>(new Set());
  const cars = shown?.cars ?? [];
  const chosen = cars.filter(({ where, kind }) => ticked.has(where) && kind === "car").map(({ where }) => where);
  const tick = (where: string) => setTicked((last) => new Set(last.has(where) ? [...last].filter((each) => each !== where) : [...last, where]));
  const all = cars.filter(({ kind, away }) => kind === "car" && !away).map(({ where }) => where);
  return (
    <section className={css.cars} aria-label={t("title")}>
      <div className="wrap">
        {!stopsElsewhere && (
          <>
            <Action danger onClick={() => order({ do: "stop" })}>{t("stopAll")}</Action>
            <Action onClick={() => order({ do: "go" })}>{t("go")}</Action>
          </>
        )}
        <Action primary disabled={!image || chosen.length === 0} onClick={() => image && order({ do: "load", where: chosen, image, program })}>
          {t("load", { count: chosen.length })}
        </Action>
      </div>
      {image === null && <p className="quiet">{t("noImage")}</p>}
      {!open && <p role="status">{t("lost")}</p>}
      <Problem text={problem ? inLanguage(problem) : ""} />
      {shown?.problem && <p className="quiet">{inLanguage(shown.problem)}</p>}
      {shown && cars.length === 0 && <p>{t("none")}</p>}
      {all.length > 1 && (
        <Tick checked={all.every((where) => ticked.has(where))} onChange={(checked) => setTicked(new Set(checked ? all : []))}>
          {t("tickAll", { count: all.length })}
        </Tick>
      )}
      <ul className={css.list}>
        {cars.map((car) => (
          <Row
            key={car.where}
            car={car}
            ticked={ticked.has(car.where)}
            onTick={() => tick(car.where)}
            onBlink={() => order({ do: "blink", where: [car.where] })}
          />
        ))}
      </ul>
      {shown && shown.others.length > 0 && <p className="quiet">{t("others", { list: shown.others.join(", ") })}</p>}
    </section>
  );
}

interface RowProps {
  car: CarRow;
  ticked: boolean;
  onTick: () => void;
  onBlink: () => void;
}

function Row({ car, ticked, onTick, onBlink }: RowProps) {
  const t = useTexts("cars");
  const isCar = car.kind === "car";
  const about = [
    !car.away ? t("here") : car.silent_s === null ? t("silent") : t("away", { seconds: car.silent_s }),
    car.role === "leader" || car.role === "follower" ? t(car.role) : "",
    car.state === "stopped" ? t("stopped") : "",
    car.program,
    car.words === null ? "" : t("program", { words: car.words, crc32: car.crc32 ?? "" }),
    car.battery_mv === null ? "" : `${(car.battery_mv / 1000).toFixed(1)} V`,
    car.board,
    car.where,
  ].filter(Boolean);
  const key = verdictKey(car);
  return (
    <li className={css.car} data-away={car.away}>
      <input type="checkbox" aria-label={t("tick", { name: car.name })} checked={ticked} disabled={!isCar} onChange={onTick} />
      <span className={classes("dot rigid", css.dot)} data-away={car.away} aria-hidden />
      <span className={css.about}>
        <b>{car.name}</b>
        <small className="quiet">{about.join(" · ")}</small>
        {key && (
          <small role="status" className="quiet" data-holds={car.holds}>
            {key === "new" && <Icon name="done" />} {t(key)} {car.error && car.holds !== "away" ? inLanguage(car.error) : ""}
          </small>
        )}
        {car.problem && !key && <small className="wrong">{inLanguage(car.problem)}</small>}
      </span>
      {isCar && (
        <Action disabled={car.away} aria-label={t("blinkNamed", { name: car.name })} onClick={onBlink}>
          {t("blink")}
        </Action>
      )}
    </li>
  );
}
