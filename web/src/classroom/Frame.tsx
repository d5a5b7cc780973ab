/** What all pages of a class share: the frame, the settings, and how a refused request is told. */

import { type ComponentProps, type ReactNode, type SyntheticEvent, useEffect, useId, useState } from "react";
import { inLanguage, type KeyIn, useLanguage, useTexts } from "../i18n";
import { SocketNotice } from "../network/SocketNotice";
import buttons from "../ui/buttons.module.css";
import { classes } from "../ui/classes";
import { SettingsSheet } from "../ui/SettingsSheet";
import { type ClassError, isClassError } from "./ask";
import css from "./class.module.css";

/** A title that may be empty or not known yet, or else another. */
export const titleOr = (title: string | undefined, other: string) => (title === undefined || title === "" ? other : title);

interface FrameProps {
  title: string;
  /** What stands in the bar, before the settings. */
  tools?: ReactNode;
  /** The content is one narrow column. */
  narrow?: boolean;
  children: ReactNode;
}

/** The bar and the content of a page. */
export function Frame({ title, tools, narrow = false, children }: FrameProps) {
  const language = useLanguage();
  useEffect(() => {
    document.title = `${title} · Motorcade`;
  }, [title, language]);
  return (
    <div className={css.page}>
      <header className={css.bar}>
        <h1>{title}</h1>
        <div className={css.tools}>{tools}</div>
        <SettingsSheet className={css.settings} />
      </header>
      <SocketNotice />
      <main className={narrow ? css.narrow : css.wide}>{children}</main>
    </div>
  );
}

/** Do what may be refused; `problem` is the sentence of the last refusal, until something succeeds. */
export function useAttempt(): { problem: string; attempt: (task: () => Promise<unknown>) => Promise<boolean> } {
  const t = useTexts("class");
  const [error, setError] = useState<ClassError | null>(null);
  const attempt = async (task: () => Promise<unknown>) => {
    try {
      await task();
      setError(null);
      return true;
    } catch (problem) {
      if (!isClassError(problem)) throw problem;
      setError(problem);
      return false;
    }
  };
  return { problem: error === null ? "" : "sentence" in error ? inLanguage(error.sentence) : t("noAnswer"), attempt };
}

/** Say what is wrong; nothing where nothing is. */
export function Problem({ text }: { text: string }) {
  return (
    <p role="alert" className={css.problem}>
      {text}
    </p>
  );
}

interface TextFieldProps {
  label: KeyIn<"class">;
  value: string;
  onChange: (text: string) => void;
  hint?: KeyIn<"class">;
  type?: "text" | "password";
  most?: number;
  numeric?: boolean;
  autoComplete?: string;
}

/** A labelled field in large type. */
export function Field({ label, value, onChange, hint, type = "text", most = 40, numeric = false, autoComplete = "off" }: TextFieldProps) {
  const t = useTexts("class");
  const id = useId();
  return (
    <div className={css.field}>
      <label htmlFor={id}>{t(label)}</label>
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
        <p id={`${id}-hint`} className={css.quiet}>
          {t(hint)}
        </p>
      )}
    </div>
  );
}

/** A form that the page answers itself; in one column, or in a row where `className` says so. */
export function Form({ onSubmit, className = css.form, children }: { onSubmit: () => void; className?: string; children: ReactNode }) {
  const submit = (event: SyntheticEvent) => {
    event.preventDefault();
    onSubmit();
  };
  return (
    <form className={className} onSubmit={submit}>
      {children}
    </form>
  );
}

/** A button; one that submits a form says so by its type. */
export function Action({ primary = false, danger = false, ...props }: ComponentProps<"button"> & { primary?: boolean; danger?: boolean }) {
  return <button type="button" {...props} className={classes(buttons.button, primary && buttons.primary, danger && css.danger)} />;
}
