import { type PointerEvent, useEffect, useRef, useState } from "react";
import { useTranslation } from "react-i18next";
import { type CompiledWord } from "../api/types";
import { colourWords, hexColour } from "../mat/colours";
import type { Session } from "../mat/session";
import { choose, chosenCar, useMat } from "../mat/store";
import { watchTheme } from "../mat/colours";
import { type Window, windowAt } from "./events";
import { AXIS_PX, LANE_PX, lookOf, paint } from "./painting";
import { TimelineTools } from "./TimelineTools";
import css from "./timeline.module.css";

const UNKNOWN = "#6e6e6e";
const REPAINT_MS = 66;
export function Timeline({ session, words }: { session: Session; words: readonly CompiledWord[] }) {
  const { t } = useTranslation();
  const [spanMs, setSpanMs] = useState(20_000);
  const cars = useMat(({ hello }) => hello?.cars ?? 0);
  return (
    <section className={css.timeline} aria-label={t("timeline.title")}>
      <TimelineTools session={session} spanMs={spanMs} onSpan={setSpanMs} />
      <Lanes session={session} words={words} spanMs={spanMs} cars={cars} />
      <p className={css.legend}>
        <span data-event="sent">{t("timeline.sent")}</span>
        <span data-event="heard">{t("timeline.heard")}</span>
        <span>{t("timeline.lost")}</span>
      </p>
    </section>
  );
}

interface LanesProps {
  session: Session;
  words: readonly CompiledWord[];
  spanMs: number;
  cars: number;
}

function Lanes({ session, words, spanMs, cars }: LanesProps) {
  const { t } = useTranslation();
  const scroller = useRef<HTMLDivElement>(null);
  const canvas = useRef<HTMLCanvasElement>(null);
  const shown = useRef<Window | null>(null);
  const [rows, setRows] = useState({ first: 0, count: 0, offsetPx: 0, heightPx: 0 });
  const chosen = useMat((now) => (now.chosen && "car" in now.chosen ? now.chosen.car : null));

  useEffect(() => {
    const element = canvas.current!;
    const { byWord } = colourWords(words);
    const colourOf = (word: number) => {
      const colour = byWord.get(word);
      return colour === undefined ? UNKNOWN : hexColour(colour);
    };
    let look = lookOf(element);
    let painted = "";
    const draw = () => {
      const { tMs, past, state } = useMat.getState();
      const nowMs = Math.max(state?.t_ms ?? 0, past ? 0 : tMs);
      shown.current = windowAt(shown.current, spanMs, tMs, past);
      const { clientWidth: width, clientHeight: height } = element;
      const what = [session.events.version, tMs, nowMs, width, height, chosenCar(), spanMs].join();
      if (what === painted || width === 0) return;
      painted = what;
      const g = sharpContext(element, width, height);
      const visible = Array.from({ length: rows.count }, (_, row) => rows.first + row).filter((car) => car < cars);
      const view = { window: shown.current, nowMs, shownMs: tMs, cars: visible, offsetPx: rows.offsetPx, chosen: chosenCar(), colourOf };
      paint(g, width, height, view, session.events, look);
    };
    draw();
    const timer = setInterval(draw, REPAINT_MS);
    const end = watchTheme(() => {
      look = lookOf(element);
      painted = "";
    });
    return () => {
      clearInterval(timer);
      end();
    };
  }, [session, words, spanMs, rows, cars]);

  useEffect(() => {
    const element = scroller.current!;
    const measure = () => {
      const first = Math.floor(element.scrollTop / LANE_PX);
      const count = Math.ceil(element.clientHeight / LANE_PX) + 1;
      setRows({ first, count, offsetPx: element.scrollTop - first * LANE_PX, heightPx: element.clientHeight });
    };
    const observer = new ResizeObserver(measure);
    observer.observe(element);
    element.addEventListener("scroll", measure, { passive: true });
    return () => {
      observer.disconnect();
      element.removeEventListener("scroll", measure);
    };
  }, [cars]);

  useEffect(() => {
    const element = scroller.current!;
    if (chosen === null) return;
    const top = chosen * LANE_PX;
    if (top < element.scrollTop || top + 2 * LANE_PX > element.scrollTop + element.clientHeight) element.scrollTop = top - LANE_PX;
  }, [chosen]);

  const scrub = (event: PointerEvent<HTMLElement>) => {
    if (event.type === "pointerdown") event.currentTarget.setPointerCapture(event.pointerId);
    if (!event.currentTarget.hasPointerCapture(event.pointerId) || !shown.current) return;
    const box = event.currentTarget.getBoundingClientRect();
    const { beginMs, endMs } = shown.current;
    session.seek(Math.round(beginMs + ((event.clientX - box.left) / box.width) * (endMs - beginMs)));
  };
  const pick = (car: number) => {
    choose({ car });
    session.watch();
  };
  const names = Array.from({ length: rows.count }, (_, row) => rows.first + row).filter((car) => car < cars);
  return (
    <div className={css.lanes} ref={scroller} tabIndex={0} role="group" aria-label={t("timeline.lanes")}>
      <div className={css.view}>
        <div className={css.names} style={{ paddingTop: AXIS_PX }}>
          <div style={{ marginTop: -rows.offsetPx }}>
            {names.map((car) => (
              <button
                key={car}
                type="button"
                tabIndex={-1}
                style={{ height: LANE_PX }}
                aria-pressed={car === chosen}
                aria-label={t("mat.car", { number: car })}
                onClick={() => pick(car)}
              >
                {car}
              </button>
            ))}
          </div>
        </div>
        <canvas ref={canvas} aria-hidden="true" onPointerDown={scrub} onPointerMove={scrub} />
      </div>
      <div style={{ height: Math.max(0, AXIS_PX + cars * LANE_PX - rows.heightPx) }} />
    </div>
  );
}

function sharpContext(element: HTMLCanvasElement, width: number, height: number): CanvasRenderingContext2D {
  const sharpness = Math.min(2, devicePixelRatio);
  element.width = width * sharpness;
  element.height = height * sharpness;
  const g = element.getContext("2d")!;
  g.scale(sharpness, sharpness);
  return g;
}
