import { type ReactNode, useId } from "react";
import { THEMES, type ThemeName, useSettings } from "../state/settings";
import { classes } from "./classes";
import { Icon } from "./icons";
import css from "./settings.module.css";

/** A page's languages, as `plainTexts` gives them. */
interface Languages {
  LANGUAGES: readonly string[];
  useLanguage: (choose: (state: { language: string }) => string) => string;
  changeLanguage: (language: string) => void;
  nameOf: (language: string) => string;
}

interface SettingsSheetProps {
  languages: Languages;
  labels: { settings: string; language: string; theme: string };
  nameOfTheme: (theme: ThemeName) => string;
  className?: string;
  /** What stands below language and colours. */
  children?: ReactNode;
}

/** The settings of a small page, behind a button: its language and its colours. */
export function SettingsSheet({ languages, labels, nameOfTheme, className, children }: SettingsSheetProps) {
  const language = languages.useLanguage((state) => state.language);
  const theme = useSettings((settings) => settings.theme);
  const ids = [useId(), useId()];
  return (
    <details className={classes(css.settings, className)}>
      <summary aria-label={labels.settings}>
        <Icon name="settings" />
      </summary>
      <div className={css.sheet}>
        <label htmlFor={ids[0]}>{labels.language}</label>
        <select id={ids[0]} value={language} onChange={(event) => languages.changeLanguage(event.target.value)}>
          {languages.LANGUAGES.map((each) => (
            <option key={each} value={each} lang={each}>
              {languages.nameOf(each)}
            </option>
          ))}
        </select>
        <label htmlFor={ids[1]}>{labels.theme}</label>
        <select id={ids[1]} value={theme} onChange={(event) => useSettings.setState({ theme: event.target.value as ThemeName })}>
          {THEMES.map((each) => (
            <option key={each} value={each}>
              {nameOfTheme(each)}
            </option>
          ))}
        </select>
        {children}
      </div>
    </details>
  );
}
