import { memo, useEffect, useState } from "react";
import type { Picture } from "../api/world";
import type { ReceivedFrame } from "../generated/messages";
import { say, useLanguage } from "../i18n";
import { isStart, useSettings } from "../state/settings";
import { clock } from "../timeline/events";
import { endAll } from "../ui/areas";
import { describe, Pace, summarize } from "./account";
import { session } from "./session";
import { useMat } from "./store";
import css from "./mat.module.css";

const MINIMUM_MS = 3000;

/** What the cars do: the sentence on the stage is true now; screen readers announce it when it has changed, in peace. */
export const Narration = memo(function Narration() {
  const language = useLanguage();
  const on = useSettings((settings) => settings.caption);
  // Who begins has not met lost messages yet.
  const begins = useSettings(isStart);
  // Before anything happened there is nothing to say over the stage.
  const begun = useMat(({ state, tMs }) => tMs > 0 || (state?.playing ?? false));
  const [sentence, setSentence] = useState("");
  const [announced, setAnnounced] = useState("");

  useEffect(() => {
    if (!on) return;
    const pace = new Pace(MINIMUM_MS);
    const tell = (picture: Picture | null) => {
      // Between two worlds there are no cars.
      if (!picture) {
        setSentence("");
        return;
      }
      const summary = summarize(picture, new Set(useMat.getState().hello?.leads), picture.past ? 0 : session.missed.count);
      setSentence(describe(summary, begins ? "none" : "counted"));
      const text = describe(summary, begins ? "none" : "mentioned");
      if (pace.due(text, performance.now(), picture.fresh)) setAnnounced(text);
    };
    tell(session.picture);
    // What was not due when the last picture came is announced later.
    const timer = setInterval(() => tell(session.picture), MINIMUM_MS);
    return endAll(session.listen(tell), () => clearInterval(timer));
  }, [on, begins, language]);

  return (
    <>
      {on && begun && sentence && <p className={css.caption} data-text={sentence} aria-hidden="true" />}
      <p className="unseen" aria-live="polite">
        {on ? announced : ""}
      </p>
    </>
  );
});

/** The last frame that a car received: its control word, sender and time, and of a tagged frame its tag and check. */
export function lastFrameText({ word, tag, check, car, t_ms }: ReceivedFrame): string {
  const frame = { word: word.toUpperCase(), car, time: clock(t_ms) };
  return tag ? say("mat.lastTaggedFrame", { ...frame, tag, check }) : say("mat.lastFrame", frame);
}
