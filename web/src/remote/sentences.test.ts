import { describe, expect, it } from "vitest";
import en from "./languages/en.json";
import zh from "./languages/zh.json";

const sources = Object.values(
  import.meta.glob<string>(["./*.{ts,tsx}", "!./*.test.ts"], { query: "?raw", import: "default", eager: true }),
).join("\n");
const places = (text: string) => (text.match(/\{\{\w+\}\}/g) ?? []).sort();

describe("the remote's languages", () => {
  it("say the same things", () => expect(Object.keys(zh)).toEqual(Object.keys(en)));

  it("fill in the same places", () => {
    const different = Object.entries(en).filter(([key, text]) => places(text).join() !== places(zh[key as keyof typeof zh]).join());
    expect(different).toEqual([]);
  });

  it("say nothing that nobody asks for", () => {
    // States and colours are said by their own names.
    const named = ["ready", "standing", "moving", "failsafe", "stopped", "program", "light", "dark", "contrast", "language"];
    expect(Object.keys(en).filter((key) => !named.includes(key) && !sources.includes(`"${key}"`))).toEqual([]);
  });
});
