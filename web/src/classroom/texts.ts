/** The texts of the class's pages in the page's language. */

import languages, { type Texts } from "virtual:texts/class";
import { plainTexts } from "../i18n/plain";
import type { Sentence } from "../generated/messages";

export type Key = keyof Texts;

export const texts = plainTexts<Texts>(languages);
export const { useLanguage, startLanguages, useTexts } = texts;

/** A sentence of the server in the page's language, for what React doesn't draw. */
export const inLanguage = (sentence: Sentence): string => sentence[useLanguage.getState().language] ?? sentence.en;

/** A function that gives a sentence of the server in the page's language. */
export function useSentences(): (sentence: Sentence) => string {
  useLanguage();
  return inLanguage;
}
