import { type PointerEvent, useEffect, useRef, useState } from "react";
import type { CompiledWord } from "../api/types";
import type { CarEvent } from "../api/world";
import { useTexts } from "../i18n";
import { colourWords, hexColour, UNKNOWN, watchTheme } from "../mat/colours";
import { session } from "../mat/session";
import { choose, chosenCar, useMat } from "../mat/store";
import { type Window, windowAt, clock, decisionOf, type Jump, jumpTo } from "./events";
import { Downloads } from "./Downloads";
import { AXIS_PX, LANE_PX, lookOf, paint } from "./painting";
import css from "./timeline.module.css";
import { useStudio, useWords } from "../state/studio";
import { flowStory } from "../words/deciding";
import { endAll, sharpContext } from "../ui/areas";
import { useScroll } from "../ui/panes";
import { Bar, Choice, ToolButton } from "../ui/fields";
import { classes } from "../ui/classes";

const REPAINT_MS = 66;
export function Timeline() {
  const t = useTexts();
  const words = useWords();
  const [spanMs, setSpanMs] = useState(20_000);
  const cars = useMat(({ hello }) => hello?.cars ?? 0);
  const decides = useMat(({ decisions }) => decisions.length > 0);
  return (
    <section className={css.timeline} aria-label={t("timeline.title")}>
      <TimelineTools spanMs={spanMs} onSpan={setSpanMs} />
      <Lanes words={words} spanMs={spanMs} cars={cars} />
      <p className={css.legend}>
        <span data-event="sent">{t("timeline.sent")}</span>
        <span data-event="heard">{t("timeline.heard")}</span>
        <span>{t("timeline.lost")}</span>
        {decides && <b>{t("timeline.decisions")}</b>}
      </p>
    </section>
  );
}

/** The cars whose lanes are in view. */
const visibleIn = (top: number, height: number, cars: number) =>
  Array.from({ length: Math.ceil(height / LANE_PX) + 1 }, (_, row) => Math.floor(top / LANE_PX) + row).filter((car) => car < cars);

function Lanes({ words, spanMs, cars }: { words: readonly CompiledWord[]; spanMs: number; cars: number }) {
  const t = useTexts();
  const scroller = useRef<HTMLDivElement>(null);
  const canvas = useRef<HTMLCanvasElement>(null);
  const shown = useRef<Window | null>(null);
  const { top, height } = useScroll(scroller);
  const offsetPx = top % LANE_PX;
  const chosen = useMat(chosenCar);

  useEffect(() => {
    const element = canvas.current!;
    const { byWord } = colourWords(words);
    const colourOf = (word: number) => hexColour(byWord.get(word) ?? UNKNOWN);
    let look = lookOf(element);
    let painted = "";
    const draw = () => {
      const { tMs, past, state } = useMat.getState();
      const nowMs = Math.max(state?.t_ms ?? 0, past ? 0 : tMs);
      shown.current = windowAt(shown.current, spanMs, tMs, past);
      const { clientWidth: width, clientHeight: tall } = element;
      const what = [session.events.version, tMs, nowMs, width, tall, chosenCar(), spanMs].join();
      if (what === painted || width === 0) return;
      painted = what;
      const g = sharpContext(element, width, tall);
      const present = { window: shown.current, nowMs, shownMs: tMs, chosen: chosenCar() };
      const view = { ...present, cars: visibleIn(top, height, cars), offsetPx, colourOf, forgotten: t("timeline.forgotten") };
      paint(g, width, tall, view, session.events, look);
    };
    draw();
    const timer = setInterval(draw, REPAINT_MS);
    const theme = watchTheme(() => {
      look = lookOf(element);
      painted = "";
    });
    return endAll(theme, () => clearInterval(timer));
  }, [words, spanMs, top, height, offsetPx, cars, t]);

  useEffect(() => {
    const element = scroller.current!;
    if (chosen === null) return;
    const lane = chosen * LANE_PX;
    if (lane < element.scrollTop || lane + 2 * LANE_PX > element.scrollTop + element.clientHeight) element.scrollTop = lane - LANE_PX;
  }, [chosen]);

  const scrub = (event: PointerEvent<HTMLElement>) => {
    if (event.type === "pointerdown") event.currentTarget.setPointerCapture(event.pointerId);
    if (!event.currentTarget.hasPointerCapture(event.pointerId) || !shown.current) return;
    const box = event.currentTarget.getBoundingClientRect();
    const { beginMs, endMs } = shown.current;
    session.seek(Math.round(beginMs + ((event.clientX - box.left) / box.width) * (endMs - beginMs)));
  };
  return (
    <div className={css.lanes} ref={scroller} tabIndex={0} role="group" aria-label={t("timeline.lanes")}>
      <div className={css.view}>
        <div className={css.names} style={{ paddingTop: AXIS_PX }}>
          <div style={{ marginTop: -offsetPx }}>
            {visibleIn(top, height, cars).map((car) => (
              <button
                key={car}
                type="button"
                className="bare figures across"
                tabIndex={-1}
                style={{ height: LANE_PX }}
                aria-pressed={car === chosen}
                aria-label={t("mat.car", { number: car })}
                onClick={() => choose({ car })}
              >
                {car}
              </button>
            ))}
          </div>
        </div>
        <canvas ref={canvas} aria-hidden="true" onPointerDown={scrub} onPointerMove={scrub} />
      </div>
      <div style={{ height: Math.max(0, AXIS_PX + cars * LANE_PX - height) }} />
    </div>
  );
}

const SPANS_S = [5, 10, 20, 60, 300];
const JUMPS: readonly Jump[] = ["word", "decision", "heard", "lost"];
/** A single step that can be seen: a tick is a millisecond. */
const STEP_MS = 100;

function TimelineTools({ spanMs, onSpan }: { spanMs: number; onSpan: (spanMs: number) => void }) {
  const t = useTexts();
  const [kind, setKind] = useState<Jump>("word");
  const [found, setFound] = useState<{ event: CarEvent; run: number } | null>(null);
  const past = useMat((now) => now.past);
  const cars = useMat(({ hello }) => hello?.cars ?? 0);
  const tickMs = useMat(({ hello }) => hello?.tick_ms ?? 1);
  const jump = (forward: boolean) => {
    const to = jumpTo(session.events.of(chosenCar() ?? 0), kind, useMat.getState().tMs, forward);
    setFound(to && { event: to, run: session.events.runs });
    if (to) session.seek(to.tMs);
  };
  return (
    <div className={classes("stack tight", css.tools)}>
      <Scrubber />
      <div className="wrap">
        <ToolButton
          icon="step"
          label={t("mat.step")}
          isDisabled={cars === 0}
          onPress={() => session.send({ do: "step", ticks: Math.max(1, Math.round(STEP_MS / tickMs)) })}
        />
        <ToolButton icon="left" label={t("timeline.previous")} onPress={() => jump(false)} />
        <Choice label={t("timeline.jump")} value={kind} all={JUMPS} name={(each) => t(`timeline.kinds.${each}`)} onChange={setKind} />
        <ToolButton icon="right" label={t("timeline.next")} onPress={() => jump(true)} />
        <Choice
          label={t("timeline.span")}
          value={String(spanMs / 1000)}
          all={SPANS_S.map(String)}
          name={(each) => t("timeline.seconds", { count: Number(each) })}
          onChange={(each) => onSpan(Number(each) * 1000)}
        />
        <Downloads />
      </div>
      <p className="quiet small" aria-live="polite">
        {found && past && found.run === session.events.runs ? <EventText event={found.event} /> : t("timeline.howTo")}
      </p>
    </div>
  );
}

/** An event as a sentence, for users who can't see the lanes. */
function EventText({ event }: { event: CarEvent }) {
  const { tMs, car, kind, why, word, other } = event;
  const t = useTexts();
  const profile = useStudio((studio) => studio.profileFigures);
  const hex = word.toString(16).padStart(8, "0").toUpperCase();
  let what = kind === "lost" && why ? t(`mat.lost.${why}`) : t(`timeline.events.${kind}`, { word: hex, car: other });
  if (kind === "flow" && profile) {
    const decision = decisionOf(event);
    const story = flowStory({ hex, part: "leader", block: null }, profile);
    what = decision === "taken" || decision === "passed" ? `${story} · ${t(decision === "taken" ? "blocks.yes" : "blocks.no")}` : story;
  }
  return `${clock(tMs)} · ${t("mat.car", { number: car })} · ${what}`;
}

function Scrubber() {
  const t = useTexts();
  const { tMs, past, state } = useMat();
  const most = Math.max(state?.t_ms ?? 0, past ? 0 : tMs, 1);
  return (
    <div className="wrap">
      <Bar
        label={t("timeline.scrub")}
        thumbLabel={`${t("timeline.scrub")} ${clock(tMs)}`}
        minValue={Math.min(state?.earliest_ms ?? 0, most - 1)}
        maxValue={most}
        step={100}
        value={Math.min(tMs, most)}
        onChange={(to) => session.seek(to)}
      />
      <ToolButton icon="present" label={t("timeline.present")} wide isDisabled={!past} onPress={() => session.seek(null)} />
    </div>
  );
}
