import { useEffect, useId, useState } from "react";
import { THEMES, useSettings, type ThemeName } from "../state/settings";
import { Icon } from "../ui/icons";
import { type Told, useRemote } from "./link";
import { changeLanguage, LANGUAGES, nameOf, useLanguage, useTexts } from "./texts";
import css from "./remote.module.css";

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
  const t = useTexts();
  const open = useRemote(({ open }) => open);
  const roundTripMs = useRemote(({ roundTripMs }) => roundTripMs);
  const silenceMs = Math.max(useSilenceMs(), useRemote(({ told }) => carsSilenceMs(told)));
  const worst = Math.round(Math.max(roundTripMs ?? 0, silenceMs > WEAK_MS ? silenceMs : 0));
  const kind = !open ? "lost" : worst > WEAK_MS ? "weak" : "good";
  const text = !open
    ? t("linkLost")
    : kind === "weak"
      ? t("linkWeak", { ms: worst })
      : roundTripMs === null
        ? t("linkIdle")
        : t("linkGood", { ms: Math.round(roundTripMs) });
  return (
    <p className={css.linkState} data-kind={kind} aria-label={`${t("link")}: ${text}`} role="img">
      <span className={css.dot} />
      {text}
    </p>
  );
}

function Settings() {
  const t = useTexts();
  const language = useLanguage(({ language }) => language);
  const theme = useSettings(({ theme }) => theme);
  const ids = [useId(), useId()];
  return (
    <details className={css.settings}>
      <summary aria-label={t("settings")}>
        <Icon name="settings" />
      </summary>
      <div className={css.settingsSheet}>
        <label htmlFor={ids[0]}>{t("languages")}</label>
        <select id={ids[0]} value={language} onChange={(event) => changeLanguage(event.target.value)}>
          {LANGUAGES.map((each) => (
            <option key={each} value={each} lang={each}>
              {nameOf(each)}
            </option>
          ))}
        </select>
        <label htmlFor={ids[1]}>{t("themes")}</label>
        <select
          id={ids[1]}
          value={theme}
          onChange={(event) => useSettings.setState({ theme: event.target.value as ThemeName })}
        >
          {THEMES.map((each) => (
            <option key={each} value={each}>
              {t(each)}
            </option>
          ))}
        </select>
      </div>
    </details>
  );
}

/** The page's name, the state of the connection, and how the page looks and speaks. */
export function Bar() {
  const t = useTexts();
  return (
    <header className={css.bar}>
      <h1>{t("title")}</h1>
      <LinkState />
      <Settings />
    </header>
  );
}
