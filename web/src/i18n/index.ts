/** The studio's languages: one file each in src/motorcade/locales, and nothing else to add a third. */

import i18next from "i18next";
import { initReactI18next } from "react-i18next";
import languages, { type Texts } from "virtual:texts/studio";
import type { Language, Sentence } from "../api/types";
import { keepLanguage, preferredLanguage } from "./plain";

export const LANGUAGES: readonly Language[] = Object.keys(languages);

declare module "i18next" {
  interface CustomTypeOptions {
    resources: { translation: Texts };
  }
}

/** Read the texts and choose the page's language. To be called once, before anything is drawn. */
export function startLanguages(): void {
  const resources = Object.fromEntries(LANGUAGES.map((each) => [each, { translation: languages[each]!.texts }]));
  void i18next.use(initReactI18next).init({
    resources,
    lng: preferredLanguage(LANGUAGES),
    fallbackLng: "en",
    interpolation: { escapeValue: false },
  });
}

export function changeLanguage(language: Language): void {
  keepLanguage(language);
  void i18next.changeLanguage(language);
}

/** What the language calls itself. */
export function nameOf(language: Language): string {
  return languages[language]?.name ?? language;
}

/** The sentence in the page's language, or in English where the server doesn't have it in that language. */
export function inLanguage(sentence: Sentence): string {
  return sentence[i18next.language] ?? sentence.en;
}
