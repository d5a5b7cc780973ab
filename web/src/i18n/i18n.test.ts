import { beforeAll, describe, expect, it } from "vitest";
import classroom from "virtual:texts/class";
import remote from "virtual:texts/remote";
import studio from "virtual:texts/studio";
import { blocklyMessages } from "../blocks/definitions";
import { SWITCHES } from "../generated/driving";
import { startLanguages } from ".";

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
const texts = new Map(
  Object.keys(studio).map((language) => [
    language,
    flat({ ...studio[language]!.texts, remote: remote[language]!.texts, class: classroom[language]!.texts }),
  ]),
);
const english = texts.get("en")!;
const others = [...texts].filter(([language]) => language !== "en");
/** Of Blockly's messages each language has those that Blockly's own file lacks. */
const isOurs = (key: string) => !key.startsWith("blockly.");
const keysOf = (entries: typeof english) => [...new Set(entries.map(([key]) => whole(key)).filter(isOurs))].sort();
// The texts of Blockly's own blocks: none of them is on this page.
const elsewhere = /^(CONTROLS|LISTS|TEXT|LOGIC|MATH|PROCEDURES|VARIABLES)_|BACKPACK|MUTATOR/;
const shown = (messages: Record<string, string>) => Object.entries(messages).filter(([key]) => !elsewhere.test(key));

const files = import.meta.glob<string>(["../**/*.{ts,tsx}", "!../**/*.test.{ts,tsx}"], { query: "?raw", import: "default", eager: true });
const isRemote = (path: string) => path.startsWith("../remote/");
const isClassroom = (path: string) => path.startsWith("../classroom/");
const sourcesWhere = (holds: (path: string) => boolean) => Object.entries(files).flatMap(([path, source]) => (holds(path) ? [source] : []));
const studioSources = sourcesWhere((path) => !isRemote(path) && !isClassroom(path));
const literals = new Set(studioSources.flatMap((source) => [...source.matchAll(/["'`]([\w.-]+)["'`]/g)].map((match) => match[1]!)));
const templates = studioSources
  .flatMap((source) => [...source.matchAll(/`([\w.]*\.(?:\$\{[^`]*?\}[\w.]*)+)`/g)].map((match) => match[1]!))
  .map((template) => new RegExp(`^${template.replaceAll(".", "\\.").replace(/\$\{.*?\}/g, "[\\w-]+")}$`));

// Keys by their own names.
const STATES = ["ready", "standing", "moving", "failsafe", "stopped", "program", "disarmed", "discharged", "away"];
const ofSettings = ["settings", "language", "theme", "light", "dark", "contrast"];

beforeAll(startLanguages);

describe("the languages", () => {
  it("are these", () => expect([...texts.keys()]).toEqual(expect.arrayContaining(["en", "zh"])));

  it.each(others)("%s has the same keys as English, for all pages", (_, entries) => {
    expect(keysOf(entries)).toEqual(keysOf(english));
  });

  it.each(others)("%s has all of Blockly's messages", async (language) => {
    const messages = await blocklyMessages(language);
    const names = shown(await blocklyMessages("en")).map(([key]) => key);
    expect(names.length).toBeGreaterThan(200);
    expect(names.filter((name) => !(name in messages))).toEqual([]);
  });

  it("have no text that the studio does not use", () => {
    const unused = keysOf(english).filter(
      (key) => !/^(remote|class)\./.test(key) && !literals.has(key) && !templates.some((template) => template.test(key)),
    );
    expect(unused).toEqual([]);
  });

  it.each([
    ["the remote", remote, isRemote, [...SWITCHES.map(({ name }) => `switch_${name}`), ...STATES]],
    ["a class", classroom, isClassroom, []],
  ] as const)("have no text that the pages of %s do not use", (_, { en }, holds, named) => {
    const sources = sourcesWhere(holds).join("\n");
    const isUsed = (key: string) => ofSettings.includes(key) || (named as readonly string[]).includes(key) || sources.includes(`"${key}"`);
    expect(Object.keys(en!.texts).filter((key) => !isUsed(key))).toEqual([]);
  });

  it.each(others)("%s has the same placeholders as English", (_, entries) => {
    const places = (text: string) => (text.match(/\{\{\w+\}\}|%\d/g) ?? []).sort().join(" ");
    const there = new Map(entries);
    const different = english.filter(([key, text]) => {
      const other = there.get(key) ?? there.get(`${whole(key)}_other`);
      return isOurs(key) && !key.endsWith("_one") && places(other!) !== places(text);
    });
    expect(different).toEqual([]);
  });

  it("use one word for a block in Chinese, in Blockly's own messages too", async () => {
    const messages = shown(await blocklyMessages("zh"));
    expect(messages.length).toBeGreaterThan(200);
    expect(messages.filter(([, text]) => text.replaceAll("块积木", "").includes("块"))).toEqual([]);
  });

  it("use the chosen words for leader, follower and word in Chinese", () => {
    const wrong = texts.get("zh")!.filter(([, text]) => /领队|跟随者|追随|单词/.test(text));
    expect(wrong).toEqual([]);
  });
});
