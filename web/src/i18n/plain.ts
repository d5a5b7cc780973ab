/** The texts of a small page, for which the studio's library would be too large; and the language that was chosen, which all pages share. */

import { create } from "zustand";
import { keep } from "../state/storage";

const KEY = "motorcade.language";

/** The language that was chosen before, else the first of the browser's that exists, else English. */
export function preferredLanguage(languages: readonly string[]): string {
  const wanted = [localStorage.getItem(KEY), ...navigator.languages].map((tag) => tag?.split("-")[0] ?? "");
  const first = wanted.find((tag) => languages.includes(tag)) ?? "en";
  // Screen readers choose their voice by this attribute.
  document.documentElement.lang = first;
  return first;
}

export function keepLanguage(language: string): void {
  keep("localStorage", KEY, language);
  document.documentElement.lang = language;
}

type Values = Record<string, string | number>;

/** Give what a page needs of its languages: each has a name and texts by key. English has all keys. */
export function plainTexts<Texts extends Record<string, string>>(languages: Record<string, { name: string; texts: Texts }>) {
  type Key = keyof Texts & string;
  const names: readonly string[] = Object.keys(languages);
  const useLanguage = create<{ language: string }>(() => ({ language: "en" }));

  /** The text of a key, with the values in place of their braces. */
  const textIn = (language: string, key: Key, values: Values = {}) => {
    const text = (languages[language]?.texts as Partial<Texts> | undefined)?.[key] ?? languages.en!.texts[key]!;
    return text.replace(/\{\{(\w+)\}\}/g, (_, name: string) => String(values[name] ?? name));
  };

  return {
    LANGUAGES: names,
    useLanguage,
    /** Choose the page's language. To be called once, before anything is drawn. */
    startLanguages: () => useLanguage.setState({ language: preferredLanguage(names) }),
    changeLanguage: (language: string) => {
      keepLanguage(language);
      useLanguage.setState({ language });
    },
    /** What a language calls itself. */
    nameOf: (language: string) => languages[language]?.name ?? language,
    textIn,
    /** A function that gives texts in the page's language. */
    useTexts: () => {
      const language = useLanguage((state) => state.language);
      return (key: Key, values?: Values) => textIn(language, key, values);
    },
  };
}
