/** Two runs on one timeline: where they part, why, and both stages at any time. */

import { type CSSProperties, useCallback, useEffect, useMemo, useState } from "react";
import type { Picture } from "../api/world";
import { Tiles } from "../classroom/drawing";
import { WorldCanvas } from "../classroom/WorldCanvas";
import type { WallWorld } from "../generated/classroom";
import type { BegunWord, Difference } from "../generated/messages";
import { inLanguage, say, useTexts } from "../i18n";
import { RADIUS_M } from "../mat/camera";
import { colourOfWord, colourWords } from "../mat/colours";
import { useMat } from "../mat/store";
import { useMission } from "../missions/store";
import { useStudio, useWords } from "../state/studio";
import { clock } from "../timeline/events";
import { Sheet, TextButton } from "../ui/controls";
import { Bar } from "../ui/fields";
import { storyOf } from "../words/story";
import { playFrom, trials, useTrials } from "./trials";
import css from "./certainty.module.css";
import { classes } from "../ui/classes";

interface ComparisonProps {
  /** What the two runs are called. */
  names: readonly [string, string];
  onClose: () => void;
}

/** Pictures that are asked for one after another, as the runs are played. */
const PICTURE_MS = 50;

export function Comparison({ names, onClose }: ComparisonProps) {
  const t = useTexts();
  const { difference, problem, comparedMs, runs, shownMs: tMs, pictures } = useTrials();
  const [playing, setPlaying] = useState(false);
  const car = difference && difference.kind !== "none" ? difference.car : null;
  const endMs = Math.max(comparedMs, difference?.t_ms ?? 0);
  useEffect(() => {
    if (!playing) return;
    const timer = setInterval(() => {
      const next = Math.min(useTrials.getState().shownMs + PICTURE_MS, endMs);
      trials.show(next);
      if (next === endMs) setPlaying(false);
    }, PICTURE_MS);
    return () => clearInterval(timer);
  }, [playing, endMs]);

  return (
    <Sheet title={t("compare.title")} onClose={onClose} wide>
      <div role="status">
        {problem && <p>{inLanguage(problem.sentence)}</p>}
        {!problem && !difference && <p>{t("compare.looking")}</p>}
        {difference && <p className={css.told}>{differenceText(difference, names)}</p>}
        {difference?.exact_ms != null && (
          <p className="quiet">{t("compare.exact", { seconds: difference.exact_ms / 1000, car: difference.exact_car })}</p>
        )}
      </div>
      {difference && (
        <>
          <div className={css.stages}>
            {names.map((name, run) => (
              <figure key={name}>
                <figcaption className="strong">{name}</figcaption>
                <RunCanvas picture={pictures[run]} car={car} label={t("compare.stage", { name, time: clock(tMs) })} />
              </figure>
            ))}
          </div>
          <Lanes difference={difference} names={names} tMs={tMs} onSeek={(to) => trials.show(to)} />
          <div className="wrap loose">
            <TextButton small onPress={() => setPlaying(!playing)}>{playing ? t("mat.pause") : t("mat.play")}</TextButton>
            <TextButton small isDisabled={difference.kind === "none"} onPress={() => trials.show(difference.t_ms)}>
              {t("compare.parting")}
            </TextButton>
            <Bar label={t("compare.time")} minValue={0} maxValue={endMs} step={100} value={tMs} onChange={(to) => trials.show(to)}>
              {difference.kind !== "none" && <span className={css.parting} style={{ "--at": difference.t_ms / Math.max(1, endMs) } as CSSProperties} />}
            </Bar>
            <span>{clock(tMs)}</span>
            {runs && (
              <TextButton
                small
                isDisabled={runs[0].image !== runs[1].image}
                onPress={() => {
                  onClose();
                  playFrom(runs[1].seed ?? 0, difference.t_ms, car === null ? [] : [car]);
                }}
              >
                {t("compare.playOther")}
              </TextButton>
            )}
          </div>
        </>
      )}
    </Sheet>
  );
}

/** One of the two stages. */
function RunCanvas({ picture, car, label }: { picture: Picture | undefined; car: number | null; label: string }) {
  const [tiles] = useState(() => new Tiles());
  const mat = useStudio((now) => now.mat);
  const hello = useMat((now) => now.hello);
  const zones = useMission(({ mission }) => mission?.zones);
  const world = useMemo(
    (): WallWorld => ({
      pupil: "",
      mat,
      leads: hello?.leads ?? [],
      radius_m: hello?.radius_m ?? RADIUS_M,
      cars: hello?.cars ?? 0,
      zones: zones ?? [],
      goals: [],
    }),
    [mat, hello, zones],
  );
  const nameOf = useCallback((each: number) => (each === car ? String(each) : undefined), [car]);
  useEffect(() => {
    if (picture) tiles.show(world.pupil, picture);
  }, [tiles, world, picture]);
  return <WorldCanvas world={world} label={label} tiles={tiles} nameOf={nameOf} className={css.stage} />;
}

/** So much time before and after the parting is shown. */
const AROUND_MS = 5000;

/** The words that the car begins in both runs, around the time at which they part. */
function Lanes({ difference, names, tMs, onSeek }: { difference: Difference; names: readonly [string, string]; tMs: number; onSeek: (tMs: number) => void }) {
  const t = useTexts();
  const words = useWords();
  const colours = useMemo(() => colourWords(words), [words]);
  if (difference.kind !== "word") return null;
  const beginMs = Math.max(0, difference.t_ms - AROUND_MS);
  const place = (ms: number) => (ms - beginMs) / (2 * AROUND_MS);
  const span = (each: BegunWord, next: BegunWord | undefined) => ({
    "--from": Math.max(0, place(each.t_ms)),
    "--to": Math.min(1, place(next?.t_ms ?? difference.t_ms + AROUND_MS)),
    background: colourOfWord(colours, each.word),
  });
  return (
    <div className={classes("stack tight anchor", css.lanes)} role="group" aria-label={t("compare.lanes", { car: difference.car })}>
      {difference.begun.map((lane, run) => (
        <ol key={run} aria-label={names[run]}>
          {lane.map((each, k) => (
            <li key={k} style={span(each, lane[k + 1]) as CSSProperties}>
              <button
                type="button"
                className="bare whole"
                title={told(each.word)}
                aria-label={`${clock(each.t_ms)} ${told(each.word)}`}
                onClick={() => onSeek(each.t_ms)}
              />
            </li>
          ))}
        </ol>
      ))}
      <span className={css.parting} style={{ "--at": place(difference.t_ms) } as CSSProperties} />
      {tMs >= beginMs && tMs <= beginMs + 2 * AROUND_MS && <span className={css.now} style={{ "--at": place(tMs) } as CSSProperties} />}
    </div>
  );
}

/** Where the two runs part, as a sentence. */
export function differenceText(difference: Difference, names: readonly [string, string]): string {
  const { kind, t_ms, car, missed, late_ms, words, cause } = difference;
  const seconds = (t_ms / 1000).toFixed(1);
  const [one, other] = names;
  if (kind === "none") return say("compare.same");
  if (kind === "place") return say("compare.place", { car, seconds });
  const because = cause ? say("compare.because", { cause: inLanguage(cause) }) : "";
  if (missed === null) {
    const [first, second] = words.map(told);
    return say("compare.other", { car, seconds, one, other, first, second, because });
  }
  const said = { car, seconds, run: names[missed], word: told(words[1 - missed] ?? null), because };
  return late_ms === null ? say("compare.missed", said) : say("compare.late", { ...said, late: (late_ms / 1000).toFixed(1) });
}

/** A word as a story. */
function told(hex: string | null): string {
  const { profileFigures } = useStudio.getState();
  if (hex === null || !profileFigures) return "";
  const leads = (useStudio.getState().compiled?.words ?? []).some(({ hex: each, part }) => part === "leader" && each === hex);
  return storyOf({ hex, part: leads ? "leader" : "followers", block: null }, profileFigures);
}
