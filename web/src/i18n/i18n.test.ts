import { describe, expect, it } from "vitest";
import { blocklyMessages } from "../blocks/messages";
import en from "./en.json";
import zh from "./zh.json";
import "./index";

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
const files = import.meta.glob<Tree>("./*.json", { eager: true, import: "default" });
const texts = new Map(Object.entries(files).map(([path, file]) => [path.slice(2, -5), flat(file)]));
const english = flat(en);
const others = [...texts].filter(([language]) => language !== "en");
/** Of Blockly's messages each language has those that Blockly's own file lacks. */
const ours = (key: string) => !key.startsWith("blockly.");
const keys = (said: typeof english) => [...new Set(said.map(([key]) => whole(key)).filter(ours))].sort();
// What blocks of Blockly's own say: none of them is on this page.
const elsewhere = /^(CONTROLS|LISTS|TEXT|LOGIC|MATH|PROCEDURES|VARIABLES)_|BACKPACK|MUTATOR/;
const shown = (messages: Record<string, string>) => Object.entries(messages).filter(([key]) => !elsewhere.test(key));

const sources = Object.entries(
  import.meta.glob<string>(["../**/*.{ts,tsx}", "!../**/*.test.{ts,tsx}"], { query: "?raw", import: "default", eager: true }),
).map(([, source]) => source);
const literals = new Set(sources.flatMap((source) => [...source.matchAll(/["'`]([\w.-]+)["'`]/g)].map((match) => match[1]!)));
const templates = sources
  .flatMap((source) => [...source.matchAll(/`([\w.]*\.(?:\$\{[^`]*?\}[\w.]*)+)`/g)].map((match) => match[1]!))
  .map((template) => new RegExp(`^${template.replaceAll(".", "\\.").replace(/\$\{.*?\}/g, "[\\w-]+")}$`));

describe("the languages", () => {
  it("are these", () => expect([...texts.keys()]).toEqual(expect.arrayContaining(["en", "zh"])));

  it.each(others)("say the same things in %s, in the studio and the remote", (_, said) => {
    expect(keys(said)).toEqual(keys(english));
  });

  it.each(others)("say all that Blockly does in %s", async (language) => {
    const said = await blocklyMessages(language);
    const names = shown(await blocklyMessages("en")).map(([key]) => key);
    expect(names.length).toBeGreaterThan(200);
    expect(names.filter((name) => !(name in said))).toEqual([]);
  });

  it("say nothing that nobody asks for", () => {
    // The remote's own test looks at its section.
    const unused = keys(english).filter(
      (key) => !key.startsWith("remote.") && !literals.has(key) && !templates.some((template) => template.test(key)),
    );
    expect(unused.filter((key) => key !== "language")).toEqual([]);
  });

  it.each(others)("fill in the same places in %s", (_, said) => {
    const places = (text: string) => (text.match(/\{\{\w+\}\}|%\d/g) ?? []).sort().join(" ");
    const there = new Map(said);
    const different = english.filter(([key, text]) => {
      const other = there.get(key) ?? there.get(`${whole(key)}_other`);
      return ours(key) && !key.endsWith("_one") && places(other!) !== places(text);
    });
    expect(different).toEqual([]);
  });

  it("call a block by one word in Chinese, in Blockly's own messages too", async () => {
    const messages = shown(await blocklyMessages("zh"));
    expect(messages.length).toBeGreaterThan(200);
    expect(messages.filter(([, text]) => text.replaceAll("块积木", "").includes("块"))).toEqual([]);
  });

  it("call leader, follower and word by their own names in Chinese", () => {
    const wrong = flat(zh).filter(([, text]) => /领队|跟随者|追随|单词/.test(text));
    expect(wrong).toEqual([]);
  });
});
