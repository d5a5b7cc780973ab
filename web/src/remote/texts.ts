/** The remote's texts in the page's language. The studio's library for texts would be too large for this small page. */

import { create } from "zustand";
import languages, { type Texts } from "virtual:texts/remote";
import { keepLanguage, preferredLanguage } from "../i18n/choice";

export type Key = keyof Texts;

export const LANGUAGES: readonly string[] = Object.keys(languages);

export const useLanguage = create<{ language: string }>(() => ({ language: "en" }));

/** Choose the page's language. To be called once, before anything is drawn. */
export function startLanguages(): void {
  useLanguage.setState({ language: preferredLanguage(LANGUAGES) });
}

export function changeLanguage(language: string): void {
  keepLanguage(language);
  useLanguage.setState({ language });
}

/** What a language calls itself. */
export const nameOf = (language: string) => languages[language]?.name ?? language;

export type Translate = (key: Key, values?: Record<string, string | number>) => string;

/** A function that gives texts in the page's language, with the values in place of their braces. */
export function useTexts(): Translate {
  const texts: Partial<Texts> = languages[useLanguage(({ language }) => language)]?.texts ?? {};
  return (key, values = {}) =>
    (texts[key] ?? languages.en!.texts[key]).replace(/\{\{(\w+)\}\}/g, (_, name: string) => String(values[name] ?? name));
}
