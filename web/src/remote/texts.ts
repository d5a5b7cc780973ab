/** The remote's texts in the page's language. */

import languages, { type Texts } from "virtual:texts/remote";
import { plainTexts } from "../i18n/plain";

export type Key = keyof Texts;

export const texts = plainTexts<Texts>(languages);
export const { useLanguage, startLanguages, useTexts } = texts;
