import i18next from "i18next";
import { memo, useEffect, useState } from "react";
import { useTranslation } from "react-i18next";
import { Flag, type Picture, type WorldState } from "../api/world";
import type { ReceivedFrame } from "../generated/messages";
import { useSettings } from "../state/settings";
import { clock } from "../timeline/events";
import type { Session } from "./session";
import { useMat } from "./store";
import controls from "../ui/controls.module.css";
import css from "./mat.module.css";

/** `driven` is a car that somebody drives, in any direction. */
const DIRECTIONS = ["forward", "left", "right", "driven"] as const;
type Activity = (typeof DIRECTIONS)[number] | "still";

export interface Summary {
  leaders: Record<Activity, number>;
  followers: Record<Activity, number>;
  lit: number;
}

function activityOf(wheels: number): Activity {
  return wheels & 3 ? (DIRECTIONS[wheels >> 2] ?? "still") : "still";
}

const noCars = (): Record<Activity, number> => ({ forward: 0, left: 0, right: 0, driven: 0, still: 0 });

export function summarize(picture: Picture, leads: ReadonlySet<number>): Summary {
  const summary: Summary = { leaders: noCars(), followers: noCars(), lit: 0 };
  for (let k = 0; k < picture.cars; k++) {
    summary[leads.has(k) ? "leaders" : "followers"][activityOf(picture.wheels[k]!)] += 1;
    if (picture.led[k]! < 4 && picture.flags[k]! & Flag.runs) summary.lit += 1;
  }
  return summary;
}

function lostOf(counts: WorldState["counts"]): number {
  return Object.entries(counts).reduce((sum, [name, count]) => (name.startsWith("lost_") ? sum + count : sum), 0);
}

/** How many frames were lost in the last seconds of the world's time, from the sums in its states. */
export class Losses {
  private sums: { tMs: number; lost: number }[] = [];

  constructor(private readonly windowMs: number) {}

  take({ t_ms: tMs, counts }: WorldState): number {
    if (this.sums.length && tMs < this.sums.at(-1)!.tMs) this.sums = [];
    this.sums.push({ tMs, lost: lostOf(counts) });
    while (this.sums.length > 2 && this.sums[1]!.tMs <= tMs - this.windowMs) this.sums.shift();
    return this.sums.at(-1)!.lost - this.sums[0]!.lost;
  }
}

/** Decides when to announce a change: not before a screen reader has finished the last announcement. */
export class Pace {
  private last: string | null = null;
  private lastAtMs = -Infinity;

  constructor(private readonly minimumMs: number) {}

  /** Whether to announce `what` now; equal texts are one announcement. */
  due(what: string, nowMs: number): boolean {
    if (what === this.last || nowMs - this.lastAtMs < this.minimumMs) return false;
    this.last = what;
    this.lastAtMs = nowMs;
    return true;
  }
}

/** 'The leader drives forward; 3 followers turn left; 4 frames lost in the last 5 seconds.' */
export function describe(summary: Summary, lost: number, seconds: number): string {
  const list = (who: "leaders" | "followers") =>
    Object.entries(summary[who])
      .filter(([, count]) => count > 0)
      .map(([what, count]) => i18next.t(`mat.account.${who}.${what as Activity}`, { count }));
  const parts = [...list("leaders"), ...list("followers")];
  if (summary.lit) parts.push(i18next.t("mat.account.lit", { count: summary.lit }));
  if (lost) parts.push(i18next.t("mat.account.lost", { count: lost, seconds }));
  return parts.join(i18next.t("mat.account.between")) + i18next.t("mat.account.end");
}

const MINIMUM_MS = 3000;
const WINDOW_S = 5;

/** What the cars do: the sentence on the stage is true now; screen readers announce it when it has changed, in peace. */
export const Narration = memo(function Narration({ session }: { session: Session }) {
  const { i18n } = useTranslation();
  const on = useSettings((settings) => settings.caption);
  // Before anything happened there is nothing to say over the stage.
  const begun = useMat(({ state, tMs }) => tMs > 0 || (state?.playing ?? false));
  const [sentence, setSentence] = useState("");
  const [announced, setAnnounced] = useState("");

  useEffect(() => {
    if (!on) return;
    const losses = new Losses(WINDOW_S * 1000);
    const pace = new Pace(MINIMUM_MS);
    let lost = 0;
    const end = useMat.subscribe(({ state }, before) => {
      if (state && state !== before.state) lost = losses.take(state);
    });
    const tell = () => {
      const { picture } = session;
      if (!picture) return;
      const summary = summarize(picture, new Set(useMat.getState().hello?.leads));
      // The losses are those of the present; who begins has not met them yet.
      const shown = picture.past || useSettings.getState().level === "start" ? 0 : lost;
      const what = JSON.stringify([summary, shown > 0]);
      const text = describe(summary, shown, WINDOW_S);
      setSentence(text);
      if (pace.due(what, performance.now())) setAnnounced(text);
    };
    tell();
    const silence = session.listen(tell);
    // What was not due when the last picture came is announced later.
    const timer = setInterval(tell, MINIMUM_MS);
    return () => {
      end();
      silence();
      clearInterval(timer);
    };
  }, [on, session, i18n.language]);

  return (
    <>
      {on && begun && sentence && <p className={css.caption} data-text={sentence} aria-hidden="true" />}
      <p className={controls.visuallyHidden} aria-live="polite">
        {on ? announced : ""}
      </p>
    </>
  );
});

/** The last frame that a car received: its control word, sender and time, and of a tagged frame its tag and check. */
export function lastFrameText({ word, tag, check, car, t_ms }: ReceivedFrame): string {
  const frame = { word: word.toUpperCase(), car, time: clock(t_ms) };
  return tag ? i18next.t("mat.lastTaggedFrame", { ...frame, tag, check }) : i18next.t("mat.lastFrame", frame);
}
