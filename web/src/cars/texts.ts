/** The texts of the list of cars, which the studio's and the teacher's page share. */

import languages, { type Texts } from "virtual:texts/cars";
import { plainTexts } from "../i18n/plain";

export type Key = keyof Texts;

export const texts = plainTexts<Texts>(languages);
