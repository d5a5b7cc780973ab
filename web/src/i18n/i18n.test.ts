import { afterAll, beforeAll, describe, expect, it, vi } from "vitest";
import remote from "virtual:texts/remote";
import studio from "virtual:texts/studio";
import { SWITCHES } from "../generated/driving";
import { changeLanguage, languageNow, languages, say, startTexts, textAt, textsOf } from ".";

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
const read = import.meta.glob<{ page: Record<string, Tree> }>("../../../src/motorcade/locales/*.json", { eager: true });
const texts = new Map(
  Object.entries(read).map(([path, { page }]) => {
    const shown = Object.fromEntries(Object.entries(page).filter(([part]) => part !== "errors"));
    return [path.slice(-7, -5), flat(shown)];
  }),
);
const english = texts.get("en")!;
const others = [...texts].filter(([language]) => language !== "en");
/** Of Blockly's messages each language has those that Blockly's own file lacks. */
const isOurs = (key: string) => !key.startsWith("blockly.");
const keysOf = (entries: typeof english) => [...new Set(entries.map(([key]) => whole(key)).filter(isOurs))].sort();
const BLOCKLY: Record<string, () => Promise<object>> = { zh: () => import("blockly/msg/zh-hans") };

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

beforeAll(() => startTexts(studio));
afterAll(() => changeLanguage("en"));

describe("the languages", () => {
  it("are these", () => expect([...texts.keys()]).toEqual(expect.arrayContaining(["en", "zh"])));

  it.each(others)("%s has the same keys as English, for all pages", (_, entries) => {
    expect(keysOf(entries)).toEqual(keysOf(english));
  });

  it.each(others)("%s has all of Blockly's messages", async (language) => {
    await changeLanguage("en");
    const names = Object.keys(textsOf("blockly"));
    const known = Object.keys((await BLOCKLY[language]?.()) ?? {});
    const ours = texts.get(language)!.map(([key]) => key.replace("blockly.", ""));
    expect(names.length).toBeGreaterThan(200);
    expect(names.filter((name) => !known.includes(name) && !ours.includes(name))).toEqual([]);
  });

  it("have no text that the studio does not use", () => {
    const isUsed = (key: string) => literals.has(key) || templates.some((template) => template.test(key));
    // Files of a part of the page leave its name out.
    const short = (key: string) => key.replace(/^(cars|network|settings)\./, "");
    const unused = keysOf(english).filter((key) => !/^(remote|class)\./.test(key) && !isUsed(key) && !literals.has(short(key)));
    expect(unused).toEqual([]);
  });

  it.each([
    ["the remote", "remote.", isRemote, [...SWITCHES.map(({ name }) => `switch_${name}`), ...STATES]],
    ["a class", "class.", isClassroom, []],
  ] as const)("have no text that the pages of %s do not use", (_, part, holds, named) => {
    const sources = sourcesWhere(holds).join("\n");
    const isUsed = (key: string) => (named as readonly string[]).includes(key) || sources.includes(`"${key}"`);
    const keys = keysOf(english).filter((key) => key.startsWith(part)).map((key) => key.slice(part.length));
    expect(keys.length).toBeGreaterThan(30);
    expect(keys.filter((key) => !isUsed(key))).toEqual([]);
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
    await changeLanguage("zh");
    const messages = Object.entries(textsOf("blockly"));
    expect(messages.length).toBeGreaterThan(200);
    expect(messages.filter(([, text]) => text.replaceAll("块积木", "").includes("块"))).toEqual([]);
  });

  it("use the chosen words for leader, follower and word in Chinese", () => {
    const wrong = texts.get("zh")!.filter(([, text]) => /领队|跟随者|追随|单词/.test(text));
    expect(wrong).toEqual([]);
  });
});

describe("the first language", () => {
  it("is the one that was chosen before, else the first of the browser's that exists, else English", async () => {
    const preferred = vi.spyOn(navigator, "languages", "get");
    const started = async (...languages: string[]) => {
      preferred.mockReturnValue(languages);
      await startTexts(studio);
      return [languageNow(), document.documentElement.lang];
    };
    localStorage.removeItem("motorcade.language");
    expect(await started("fr-FR", "zh-CN", "en")).toEqual(["zh", "zh"]);
    expect(await started("fr-FR")).toEqual(["en", "en"]);
    await changeLanguage("zh");
    expect(await started("en-GB")).toEqual(["zh", "zh"]);
    preferred.mockRestore();
    await changeLanguage("en");
  });
});

describe("a text", () => {
  it("has the form for a number, in languages with several forms and with one", async () => {
    await changeLanguage("en");
    expect([0, 1, 2].map((count) => say("examples.cars", { count }))).toEqual(["0 cars", "1 car", "2 cars"]);
    await changeLanguage("zh");
    expect([1, 2].map((count) => say("examples.cars", { count }))).toEqual(["1 辆小车", "2 辆小车"]);
  });

  it("may not exist", () => {
    expect(textAt("examples.none")).toBeUndefined();
    expect(textAt("examples")).toBeUndefined();
  });

  it("is of the page alone that shows it, and of all pages in the chosen language", async () => {
    expect(languages().slice(0, 1)).toEqual(["en"]);
    const { default: parts } = await remote.zh!.load();
    expect(Object.keys(parts as object).sort()).toEqual(["network", "remote", "settings"]);
  });
});
