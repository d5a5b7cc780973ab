/** The frame, the fields and the buttons of small pages: a class's, the wall's, the remote's. They are the browser's own. */

import { type ComponentProps, type KeyboardEvent, lazy, type ReactNode, type SyntheticEvent, useEffect, useId, useRef, useState } from "react";
import { changeLanguage, languages, nameOf, useLanguage, useTexts } from "../i18n";
import { useQuestion } from "../state/questions";
import { THEMES, type ThemeName, useSettings } from "../state/settings";
import { classes } from "./classes";
import { Icon } from "./icons";
import { Later } from "./panes";
import { SocketNotice } from "./SocketNotice";
import buttons from "./buttons.module.css";
import css from "./page.module.css";

const QuestionDialog = lazy(() => import("./QuestionDialog"));

interface PageProps {
  title: string;
  /** What stands in the bar, before the settings. */
  tools?: ReactNode;
  /** What stands in the settings, below language and colours. */
  settings?: ReactNode;
  className?: string;
  children: ReactNode;
}

/** The bar and the content of a page, and above them the question that it asks. */
export function Page({ title, tools, settings, className, children }: PageProps) {
  const asks = useQuestion((state) => state.question !== null);
  useEffect(() => {
    document.title = `${title} · Motorcade`;
  }, [title]);
  return (
    <div className={css.page}>
      <header className={css.bar}>
        <h1>{title}</h1>
        <div className={classes("wrap end", css.tools)}>{tools}</div>
        <SettingsSheet>{settings}</SettingsSheet>
      </header>
      <SocketNotice />
      {asks && (
        <Later>
          <QuestionDialog />
        </Later>
      )}
      <main className={className}>{children}</main>
    </div>
  );
}

/** The settings, behind a button: language and colours, and below them the children. Escape, or a press elsewhere, closes them. */
function SettingsSheet({ children }: { children: ReactNode }) {
  const t = useTexts("settings");
  const language = useLanguage();
  const theme = useSettings((settings) => settings.theme);
  const [problem, setProblem] = useState("");
  const sheet = useRef<HTMLDetailsElement>(null);
  useEffect(() => {
    const listening = new AbortController();
    const closeFromOutside = ({ target }: Event) => {
      if (!sheet.current!.contains(target as Node)) sheet.current!.open = false;
    };
    document.addEventListener("pointerdown", closeFromOutside, { signal: listening.signal });
    return () => listening.abort();
  }, []);
  const closeByEscape = ({ key }: KeyboardEvent) => {
    if (key !== "Escape") return;
    sheet.current!.open = false;
    sheet.current!.querySelector("summary")!.focus();
  };
  const choose = (chosen: string) => void changeLanguage(chosen).then(() => setProblem(""), () => setProblem(t("noTexts")));
  return (
    <details ref={sheet} className={classes("anchor", css.settings)} onKeyDown={closeByEscape}>
      <summary aria-label={t("title")}>
        <Icon name="settings" />
      </summary>
      <div className={css.sheet}>
        <Choice label={t("language")} value={language} onChange={choose}>
          {languages().map((other) => (
            <option key={other} value={other} lang={other}>
              {nameOf(other)}
            </option>
          ))}
        </Choice>
        <Choice label={t("theme")} value={theme} onChange={(chosen) => useSettings.setState({ theme: chosen as ThemeName })}>
          {THEMES.map((name) => (
            <option key={name} value={name}>
              {t(name)}
            </option>
          ))}
        </Choice>
        {problem && <Problem text={problem} />}
        {children}
      </div>
    </details>
  );
}

interface ChoiceProps {
  label: string;
  value: string | number;
  onChange: (value: string) => void;
  /** Its options. */
  children: ReactNode;
}

/** A list of which one entry is chosen, and its label. */
export function Choice({ label, value, onChange, children }: ChoiceProps) {
  return (
    <label className={classes("wrap", css.choice)}>
      {label}
      <select value={value} onChange={(event) => onChange(event.target.value)}>
        {children}
      </select>
    </label>
  );
}

interface TickProps {
  checked: boolean;
  onChange: (checked: boolean) => void;
  /** Ticks of one group, of which one is chosen. */
  group?: string;
  children: ReactNode;
}

/** A box or a round one to tick, and its label. */
export function Tick({ checked, onChange, group, children }: TickProps) {
  return (
    <label className={css.tick}>
      <input type={group ? "radio" : "checkbox"} name={group} checked={checked} onChange={(event) => onChange(event.target.checked)} />
      {children}
    </label>
  );
}

interface FieldProps {
  label: string;
  value: string;
  onChange: (text: string) => void;
  hint?: string;
  type?: "text" | "password";
  most?: number;
  numeric?: boolean;
  autoComplete?: string;
}

/** A labelled field in large type. */
export function Field({ label, value, onChange, hint, type = "text", most = 40, numeric = false, autoComplete = "off" }: FieldProps) {
  const id = useId();
  return (
    <div className={css.field}>
      <label htmlFor={id}>{label}</label>
      <input
        id={id}
        type={type}
        value={value}
        maxLength={most}
        inputMode={numeric ? "numeric" : undefined}
        autoComplete={autoComplete}
        autoCapitalize="off"
        spellCheck={false}
        aria-describedby={hint && `${id}-hint`}
        onChange={(event) => onChange(event.target.value)}
      />
      {hint && (
        <p id={`${id}-hint`} className="quiet small">
          {hint}
        </p>
      )}
    </div>
  );
}

/** A form that the page answers itself; in one column, or in a row where `className` says so. */
export function Form({ onSubmit, className = css.form, id, children }: { onSubmit: () => void; className?: string; id?: string; children: ReactNode }) {
  const submit = (event: SyntheticEvent) => {
    event.preventDefault();
    onSubmit();
  };
  return (
    <form id={id} className={className} onSubmit={submit}>
      {children}
    </form>
  );
}

/** Say what is wrong; nothing where nothing is. */
export function Problem({ text }: { text: string }) {
  return (
    <p role="alert" className="wrong said">
      {text}
    </p>
  );
}

interface ActionProps extends ComponentProps<"button"> {
  /** What is usually wanted here. */
  primary?: boolean;
  danger?: boolean;
}

/** A button; one that submits a form says so by its type. */
export function Action({ primary = false, danger = false, className, ...props }: ActionProps) {
  return <button type="button" {...props} className={classes(buttons.button, primary && buttons.primary, danger && buttons.danger, className)} />;
}
