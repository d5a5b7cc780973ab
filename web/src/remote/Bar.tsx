import { useEffect, useId, useState } from "react";
import { THEMES, useSettings, type ThemeName } from "../app/settings";
import { Icon } from "../app/icons";
import { type Told, useRemote } from "./link";
import { changeLanguage, LANGUAGES, nameOf, useLanguage, useSay } from "./sentences";

/** A car hears nothing for longer: it has stopped by itself. */
const WEAK_MS = 300;
const LOOK_EVERY_MS = 250;

/** For how long nothing was heard, looked at from time to time. */
function useSilenceMs(): number {
  const [silenceMs, setSilenceMs] = useState(0);
  useEffect(() => {
    const timer = setInterval(() => {
      setSilenceMs(performance.now() - useRemote.getState().heardMs);
    }, LOOK_EVERY_MS);
    return () => clearInterval(timer);
  }, []);
  return silenceMs;
}

/** For how long the most silent of the cars was not heard of behind the server; those that are away say so themselves. */
function carsSilenceMs(told: Record<string, Told>): number {
  return Math.max(0, ...Object.values(told).map((car) => (car.state === "away" ? 0 : car.silent_ms)));
}

function LinkState() {
  const say = useSay();
  const open = useRemote(({ open }) => open);
  const roundTripMs = useRemote(({ roundTripMs }) => roundTripMs);
  const silenceMs = Math.max(useSilenceMs(), useRemote(({ told }) => carsSilenceMs(told)));
  const worst = Math.round(Math.max(roundTripMs ?? 0, silenceMs > WEAK_MS ? silenceMs : 0));
  const kind = !open ? "lost" : worst > WEAK_MS ? "weak" : "good";
  const text = !open
    ? say("linkLost")
    : kind === "weak"
      ? say("linkWeak", { ms: worst })
      : roundTripMs === null
        ? say("linkIdle")
        : say("linkGood", { ms: Math.round(roundTripMs) });
  return (
    <p className="link-state" data-kind={kind} aria-label={`${say("link")}: ${text}`} role="img">
      <span className="dot" />
      {text}
    </p>
  );
}

function Settings() {
  const say = useSay();
  const language = useLanguage(({ language }) => language);
  const theme = useSettings(({ theme }) => theme);
  const ids = [useId(), useId()];
  return (
    <details className="settings">
      <summary aria-label={say("settings")}>
        <Icon name="settings" />
      </summary>
      <div className="settings-sheet">
        <label htmlFor={ids[0]}>{say("languages")}</label>
        <select id={ids[0]} value={language} onChange={(event) => changeLanguage(event.target.value)}>
          {LANGUAGES.map((each) => (
            <option key={each} value={each} lang={each}>
              {nameOf(each)}
            </option>
          ))}
        </select>
        <label htmlFor={ids[1]}>{say("themes")}</label>
        <select
          id={ids[1]}
          value={theme}
          onChange={(event) => useSettings.setState({ theme: event.target.value as ThemeName })}
        >
          {THEMES.map((each) => (
            <option key={each} value={each}>
              {say(each)}
            </option>
          ))}
        </select>
      </div>
    </details>
  );
}

/** The page's name, the state of the connection, and how the page looks and speaks. */
export function Bar() {
  const say = useSay();
  return (
    <header className="bar">
      <h1>{say("title")}</h1>
      <LinkState />
      <Settings />
    </header>
  );
}
