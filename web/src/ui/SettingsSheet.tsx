import { type ReactNode, useId } from "react";
import { THEMES, type ThemeName, useSettings } from "../state/settings";
import { classes } from "./classes";
import { Icon } from "./icons";
import css from "./settings.module.css";

/** What the sheet needs of a page's texts, as `plainTexts` gives them. */
interface SettingsTexts {
  LANGUAGES: readonly string[];
  useLanguage: (choose: (state: { language: string }) => string) => string;
  changeLanguage: (language: string) => void;
  nameOf: (language: string) => string;
  useTexts: () => (key: "settings" | "language" | "theme" | ThemeName) => string;
}

/** The settings of a small page, behind a button: its language and its colours, and below them the children. */
export function SettingsSheet({ texts, className, children }: { texts: SettingsTexts; className?: string; children?: ReactNode }) {
  const t = texts.useTexts();
  const language = texts.useLanguage((state) => state.language);
  const theme = useSettings((settings) => settings.theme);
  const ids = [useId(), useId()];
  return (
    <details className={classes(css.settings, className)}>
      <summary aria-label={t("settings")}>
        <Icon name="settings" />
      </summary>
      <div className={css.sheet}>
        <label htmlFor={ids[0]}>{t("language")}</label>
        <select id={ids[0]} value={language} onChange={(event) => texts.changeLanguage(event.target.value)}>
          {texts.LANGUAGES.map((each) => (
            <option key={each} value={each} lang={each}>
              {texts.nameOf(each)}
            </option>
          ))}
        </select>
        <label htmlFor={ids[1]}>{t("theme")}</label>
        <select id={ids[1]} value={theme} onChange={(event) => useSettings.setState({ theme: event.target.value as ThemeName })}>
          {THEMES.map((each) => (
            <option key={each} value={each}>
              {t(each)}
            </option>
          ))}
        </select>
        {children}
      </div>
    </details>
  );
}
