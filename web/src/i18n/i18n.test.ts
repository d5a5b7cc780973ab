import { describe, expect, it } from "vitest";
import * as blockly from "blockly/msg/zh-hans";
import en from "./en.json";
import zh from "./zh.json";

interface Tree {
  [key: string]: Tree | string;
}

function flat(tree: Tree, path = ""): [key: string, text: string][] {
  return Object.entries(tree).flatMap(([key, value]) =>
    typeof value === "string" ? [[path + key, value] as [string, string]] : flat(value, `${path}${key}.`),
  );
}

/** Languages differ in how many forms of the plural they have. */
const whole = (key: string) => key.replace(/_(zero|one|two|few|many|other)$/, "");
const texts = { en: flat(en), zh: flat(zh) };
const keys = (language: keyof typeof texts) => [...new Set(texts[language].map(([key]) => whole(key)))].sort();

const sources = Object.entries(
  import.meta.glob<string>(["../**/*.{ts,tsx}", "!../**/*.test.{ts,tsx}"], { query: "?raw", import: "default", eager: true }),
).map(([, source]) => source);
const literals = new Set(sources.flatMap((source) => [...source.matchAll(/["'`]([\w.-]+)["'`]/g)].map((match) => match[1]!)));
const templates = sources
  .flatMap((source) => [...source.matchAll(/`([\w.]*\.(?:\$\{[^`]*?\}[\w.]*)+)`/g)].map((match) => match[1]!))
  .map((template) => new RegExp(`^${template.replaceAll(".", "\\.").replace(/\$\{.*?\}/g, "[\\w-]+")}$`));

describe("the languages", () => {
  it("say the same things", () => expect(keys("zh")).toEqual(keys("en")));

  it("say nothing that nobody asks for", () => {
    const unused = keys("en").filter(
      // Blockly takes its own as they are.
      (key) => !key.startsWith("blockly.") && !literals.has(key) && !templates.some((template) => template.test(key)),
    );
    expect(unused.filter((key) => key !== "language")).toEqual([]);
  });

  it("fill in the same places", () => {
    const places = (text: string) => (text.match(/\{\{\w+\}\}|%\d/g) ?? []).sort().join(" ");
    const chinese = new Map(texts.zh);
    const different = texts.en.filter(([key, text]) => {
      const other = chinese.get(key) ?? chinese.get(`${whole(key)}_other`);
      return !key.endsWith("_one") && places(other!) !== places(text);
    });
    expect(different).toEqual([]);
  });

  it("call a block by one word in Chinese, in Blockly's own messages too", () => {
    // What blocks of Blockly's own say: none of them is on this page.
    const elsewhere = /^(CONTROLS|LISTS|TEXT|LOGIC|MATH|PROCEDURES|VARIABLES)_|BACKPACK|MUTATOR/;
    const shown = Object.entries({ ...blockly, ...zh.blockly }).filter(([key]) => !elsewhere.test(key));
    expect(shown.length).toBeGreaterThan(200);
    expect(shown.filter(([, text]) => typeof text === "string" && text.replaceAll("块积木", "").includes("块"))).toEqual([]);
  });

  it("call leader, follower and word by their own names in Chinese", () => {
    const wrong = texts.zh.filter(([, text]) => /领队|跟随者|追随|单词/.test(text));
    expect(wrong).toEqual([]);
  });
});
