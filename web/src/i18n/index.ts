/** The studio's languages: one JSON file each, which has the remote's sentences too, and nothing else to add a third. */

import i18next from "i18next";
import { initReactI18next } from "react-i18next";
import type { Language, Sentence } from "../api/types";
import { firstLanguage, keepLanguage } from "./choice";
import type en from "./en.json";

/** Every JSON file beside this one is a language. */
const files = Object.entries(import.meta.glob<typeof en>("./*.json", { eager: true, import: "default" }));
const resources = Object.fromEntries(files.map(([path, translation]) => [path.slice(2, -5), { translation }]));
export const LANGUAGES: readonly Language[] = Object.keys(resources);

declare module "i18next" {
  interface CustomTypeOptions {
    resources: { translation: typeof en };
  }
}

void i18next.use(initReactI18next).init({
  resources,
  lng: firstLanguage(LANGUAGES),
  fallbackLng: "en",
  interpolation: { escapeValue: false },
});

export function currentLanguage(): Language {
  return i18next.language;
}

export function changeLanguage(language: Language): void {
  keepLanguage(language);
  void i18next.changeLanguage(language);
}

/** What the language calls itself. */
export function nameOf(language: Language): string {
  return resources[language]?.translation.language ?? language;
}

/** The sentence in the page's language, or in English where the server doesn't speak it. */
export function spoken(sentence: Sentence): string {
  return sentence[currentLanguage()] ?? sentence.en;
}
