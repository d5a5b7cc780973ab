import { type ReactNode, useId } from "react";
import { changeLanguage, languages, nameOf, useLanguage, useTexts } from "../i18n";
import { THEMES, type ThemeName, useSettings } from "../state/settings";
import { classes } from "./classes";
import { Icon } from "./icons";
import css from "./settings.module.css";

/** The settings of a small page, behind a button: its language and its colours, and below them the children. */
export function SettingsSheet({ className, children }: { className?: string; children?: ReactNode }) {
  const t = useTexts("settings");
  const language = useLanguage();
  const theme = useSettings((settings) => settings.theme);
  const ids = [useId(), useId()];
  return (
    <details className={classes(css.settings, className)}>
      <summary aria-label={t("title")}>
        <Icon name="settings" />
      </summary>
      <div className={css.sheet}>
        <label htmlFor={ids[0]}>{t("language")}</label>
        <select id={ids[0]} value={language} onChange={(event) => void changeLanguage(event.target.value)}>
          {languages().map((other) => (
            <option key={other} value={other} lang={other}>
              {nameOf(other)}
            </option>
          ))}
        </select>
        <label htmlFor={ids[1]}>{t("theme")}</label>
        <select id={ids[1]} value={theme} onChange={(event) => useSettings.setState({ theme: event.target.value as ThemeName })}>
          {THEMES.map((name) => (
            <option key={name} value={name}>
              {t(name)}
            </option>
          ))}
        </select>
        {children}
      </div>
    </details>
  );
}
