/** The remote's languages: one JSON file each, like the studio's, with which it shares the chosen one. */

import { create } from "zustand";
import type en from "./languages/en.json";

const KEPT = "motorcade.language";
const files = Object.entries(import.meta.glob<typeof en>("./languages/*.json", { eager: true, import: "default" }));
const languages = Object.fromEntries(files.map(([path, sentences]) => [path.split("/").pop()!.slice(0, -5), sentences]));
export const LANGUAGES: readonly string[] = Object.keys(languages);
export type Key = keyof typeof en;

function firstLanguage(): string {
  const wished = [localStorage.getItem(KEPT), ...navigator.languages].map((tag) => tag?.split("-")[0] ?? "");
  return wished.find((tag) => LANGUAGES.includes(tag)) ?? "en";
}

export const useLanguage = create<{ language: string }>(() => ({ language: firstLanguage() }));
document.documentElement.lang = useLanguage.getState().language;

export function changeLanguage(language: string): void {
  localStorage.setItem(KEPT, language);
  document.documentElement.lang = language;
  useLanguage.setState({ language });
}

/** What a language calls itself. */
export const nameOf = (language: string) => languages[language]?.language ?? language;

export type Say = (key: Key, values?: Record<string, string | number>) => string;

/** Says sentences in the page's language, with what stands in their braces filled in. */
export function useSay(): Say {
  const sentences = languages[useLanguage(({ language }) => language)]!;
  return (key, values = {}) =>
    sentences[key].replace(/\{\{(\w+)\}\}/g, (_, name: string) => String(values[name] ?? name));
}
