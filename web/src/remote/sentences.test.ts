import { expect, it } from "vitest";
import { changeLanguage, LANGUAGES, nameOf, useLanguage } from "./sentences";
import en from "../i18n/en.json";

const sources = Object.values(
  import.meta.glob<string>(["./*.{ts,tsx}", "!./*.test.ts"], { query: "?raw", import: "default", eager: true }),
).join("\n");

it("says nothing that nobody asks for", () => {
  // States and colours are said by their own names.
  const named = ["ready", "standing", "moving", "failsafe", "stopped", "program", "away", "light", "dark", "contrast"];
  expect(Object.keys(en.remote).filter((key) => !named.includes(key) && !sources.includes(`"${key}"`))).toEqual([]);
});

it("speaks every language of the studio", () => {
  const files = Object.keys(import.meta.glob("../i18n/*.json"));
  expect(LANGUAGES.map((language) => `../i18n/${language}.json`)).toEqual(files);
  expect(LANGUAGES.map(nameOf)).toContain("中文");
  changeLanguage("zh");
  expect([useLanguage.getState().language, document.documentElement.lang]).toEqual(["zh", "zh"]);
});
