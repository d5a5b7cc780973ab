/**
 * The texts of all pages, in one language at a time.
 *
 * A language is one file of src/motorcade/locales. A page imports `virtual:texts/<page>`, which lists the languages; of
 * each only the parts that the page shows are fetched, when it is chosen. A text is found by its path in `page` of that
 * file ("app.close"), its braces are filled, and with a `count` it has the form that the language has for that number.
 */

import { create } from "zustand";
import type { Language, Sentence } from "../api/types";
import { keep } from "../state/storage";

export type Texts = Omit<(typeof import("../../../src/motorcade/locales/en.json"))["page"], "errors">;

/** A key without the form of its plural. */
type Plain<Key extends string> = Key extends `${infer Stem}_${"one" | "other"}` ? Stem : Key;
type Keys<Tree> = { [Name in keyof Tree & string]: Tree[Name] extends string ? Plain<Name> : `${Name}.${Keys<Tree[Name]>}` }[keyof Tree & string];

/** The path of a text. */
export type Key = Keys<Texts>;
/** The path of a text in one part of the page. */
export type KeyIn<Part extends keyof Texts> = Keys<Texts[Part]>;

type Values = Record<string, string | number | null | undefined>;
interface Tree {
  [name: string]: Tree | string;
}

/** The languages of a page: what each calls itself, and what fetches its texts. */
export type Languages = Record<Language, { name: string; load: () => Promise<{ default: unknown }> }>;

const KEY = "motorcade.language";
/** The languages of the page, and of a part of another page that it shows. */
const sources: Languages[] = [];
let texts: Tree = {};
let plurals = new Intl.PluralRules("en");

const useLanguageStore = create<{ language: Language }>(() => ({ language: "en" }));

export const languages = (): readonly Language[] => Object.keys(sources[0]!);

/** What a language calls itself. */
export const nameOf = (language: Language): string => sources[0]![language]?.name ?? language;

/** The page's language. */
export const languageNow = (): Language => useLanguageStore.getState().language;
export const useLanguage = (): Language => useLanguageStore((state) => state.language);
export const watchLanguage = (changed: () => void) => useLanguageStore.subscribe(changed);

/** The language that was chosen before, else the first of the browser's that exists, else English. */
function preferredLanguage(): Language {
  const wanted = [localStorage.getItem(KEY), ...navigator.languages].map((tag) => tag?.split("-")[0] ?? "");
  return wanted.find((tag) => languages().includes(tag)) ?? "en";
}

async function show(language: Language): Promise<void> {
  const parts = await Promise.all(sources.map((source) => source[language]!.load()));
  texts = Object.assign({}, ...parts.map((part) => part.default)) as Tree;
  saying.clear();
  plurals = new Intl.PluralRules(language);
  // Screen readers choose their voice by this attribute.
  document.documentElement.lang = language;
  useLanguageStore.setState({ language });
}

/** Fetch a page's texts in the language that its user prefers. To be awaited before anything is drawn. */
export async function startTexts(page: Languages): Promise<void> {
  if (!sources.includes(page)) sources.push(page);
  await show(preferredLanguage());
}

/** Change the language, of all pages in this browser. Where its texts can't be fetched, all stays as it is. */
export async function changeLanguage(language: Language): Promise<void> {
  await show(language);
  keep("localStorage", KEY, language);
}

function lookUp(key: string): string | undefined {
  let found: Tree | string | undefined = texts;
  for (const name of key.split(".")) found = typeof found === "object" ? found[name] : undefined;
  return typeof found === "string" ? found : undefined;
}

/** All texts of a part without parts of its own. */
export const textsOf = (part: "blockly") => texts[part] as Record<string, string>;

/** The text of a key that may not exist; undefined where it doesn't. */
export function textAt(key: string, values: Values = {}): string | undefined {
  const { count } = values;
  const form = typeof count === "number" ? lookUp(`${key}_${plurals.select(count)}`) : undefined;
  const text = form ?? lookUp(key) ?? lookUp(`${key}_other`);
  return text?.replace(/\{\{(\w+)\}\}/g, (_, name: string) => String(values[name] ?? ""));
}

/** A text in the page's language, with the values in place of their braces. */
export const say = (key: Key, values?: Values): string => textAt(key, values) ?? key;

type Say = (key: string, values?: Values) => string;
/** What `useTexts` gives, by the part; others in another language, so that what was made of a text is made anew. */
const saying = new Map<string | undefined, Say>();

/** A function that gives texts in the page's language: all, by their paths, or those of one part of the page. */
export function useTexts(): typeof say;
export function useTexts<Part extends keyof Texts>(part: Part): (key: KeyIn<Part>, values?: Values) => string;
export function useTexts(part?: string): Say {
  useLanguage();
  const known = saying.get(part);
  if (known) return known;
  const before = part === undefined ? "" : `${part}.`;
  const made: Say = (key, values) => textAt(before + key, values) ?? key;
  saying.set(part, made);
  return made;
}

/** The sentence in the page's language, or in English where the server doesn't have it in that language. */
export const inLanguage = (sentence: Sentence): string => sentence[languageNow()] ?? sentence.en;
