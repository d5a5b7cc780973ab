/** The remote's sentences: the section `remote` of every language's file, without the rest, which the studio needs. */

import { create } from "zustand";
import { firstLanguage, keepLanguage } from "../i18n/choice";
import type en from "../i18n/en.json";

type Sentences = typeof en.remote;
export type Key = keyof Sentences;

// With a query it is another module than the studio's, of which only what is named here gets into the page. Vite tells
// JSON by how a name ends.
const sections = import.meta.glob<Sentences>("../i18n/*.json", { eager: true, query: "?remote.json", import: "remote" });
const names = import.meta.glob<string>("../i18n/*.json", { eager: true, query: "?remote.json", import: "language" });
const tagged = <T>(files: Record<string, T>) =>
  Object.fromEntries(Object.entries(files).map(([path, found]) => [/(\w+)\.json/.exec(path)![1]!, found]));
const languages = tagged(sections);
const ownNames = tagged(names);
export const LANGUAGES: readonly string[] = Object.keys(languages);

export const useLanguage = create<{ language: string }>(() => ({ language: firstLanguage(LANGUAGES) }));

export function changeLanguage(language: string): void {
  keepLanguage(language);
  useLanguage.setState({ language });
}

/** What a language calls itself. */
export const nameOf = (language: string) => ownNames[language] ?? language;

export type Say = (key: Key, values?: Record<string, string | number>) => string;

/** Says sentences in the page's language, with what stands in their braces filled in. */
export function useSay(): Say {
  const sentences = languages[useLanguage(({ language }) => language)]!;
  return (key, values = {}) =>
    sentences[key].replace(/\{\{(\w+)\}\}/g, (_, name: string) => String(values[name] ?? name));
}
