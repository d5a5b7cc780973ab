import { describe, expect, it } from "vitest";
import { changeLanguage, startLanguages } from "../i18n";
import { heardText } from "./heard";

startLanguages();

const BARE = { word: "c0280000", tag: 0, check: 0, car: 3, t_ms: 65_000 };
const TAGGED = { ...BARE, tag: 5, check: 28 };

describe("the last frame that a car received", () => {
  it("is its word, its sender and its time", () => {
    changeLanguage("en");
    expect(heardText(BARE)).toBe("Heard last: C0280000 from car 3 at 1:05.0");
  });

  it("names tag and check where it is tagged, in both languages", () => {
    changeLanguage("en");
    expect(heardText(TAGGED)).toBe("Heard last: C0280000 with tag 5 and check 28 from car 3 at 1:05.0");
    changeLanguage("zh");
    expect(heardText(TAGGED)).toBe("最近收到：C0280000，标签 5，校验码 28，来自小车 3，时间 1:05.0");
    expect(heardText(BARE)).not.toContain("标签");
    changeLanguage("en");
  });
});
