/** The texts of the class's pages in the page's language. */

import languages, { type Texts } from "virtual:texts/class";
import { plainTexts } from "../i18n/plain";
import type { Sentence } from "../generated/messages";

export type Key = keyof Texts;

export const texts = plainTexts<Texts>(languages);
export const { useLanguage, startLanguages, useTexts } = texts;

/** A function that gives a sentence of the server in the page's language. */
export function useSentences(): (sentence: Sentence) => string {
  const language = useLanguage((state) => state.language);
  return (sentence) => sentence[language as keyof Sentence] ?? sentence.en;
}
