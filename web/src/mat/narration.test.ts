import { expect, it } from "vitest";
import texts from "virtual:texts/studio";
import { changeLanguage, startTexts } from "../i18n";
import { describe, Pace, summarize } from "./account";
import { lastFrameText } from "./Narration";
import { pictureOf } from "./testPictures";

await startTexts(texts);
const [FORWARD, LEFT] = [2, 5];
const SUMMARY = summarize(
  pictureOf([{ wheels: FORWARD }, { wheels: FORWARD, led: 1 }, { wheels: FORWARD }, { wheels: FORWARD }, { wheels: LEFT }, {}], {}),
  new Set([0]),
  4,
);

it("counts what leaders and followers do", () => {
  expect(SUMMARY.leaders).toEqual({ forward: 1, left: 0, right: 0, driven: 0, stuck: 0, still: 0 });
  expect(SUMMARY.followers).toEqual({ forward: 3, left: 1, right: 0, driven: 0, stuck: 0, still: 1 });
  expect(SUMMARY.lit).toBe(1);
});

it("describes it in both languages", async () => {
  await changeLanguage("en");
  expect(describe(SUMMARY, "counted")).toBe(
    "The leader drives forward; 3 followers drive forward; 1 follower turns left; 1 follower stands still; " +
      "1 car has a lamp on; 4 messages lost in the last 5 seconds.",
  );
  await changeLanguage("zh");
  expect(describe(SUMMARY, "none")).toBe("1 辆头车前进；3 辆跟车前进；1 辆跟车左转；1 辆跟车静止；1 辆小车亮灯。");
});

it("says of lost messages what stays true while their number changes", async () => {
  await changeLanguage("en");
  expect(describe(SUMMARY, "mentioned")).toContain("; messages were lost in the last 5 seconds.");
  expect(describe({ ...SUMMARY, lost: 0 }, "mentioned")).not.toContain("lost");
});

it("says nothing where there is no car", () => {
  expect(describe(summarize(pictureOf([]), new Set(), 0), "counted")).toBe("");
});

it("announces another world at once", () => {
  const pace = new Pace(3000);
  expect([pace.due("a", 0), pace.due("b", 100), pace.due("b", 200, true), pace.due("b", 300, true)]).toEqual([true, false, true, false]);
});

it("announces changes, each no earlier than the one before could be announced", () => {
  const pace = new Pace(3000);
  const announced = (
    [
      [0, "forward"],
      [1000, "forward"],
      [1200, "left"],
      [3000, "left"],
      [3500, "forward"],
      [5900, "left"],
      [6000, "left"],
      [6200, "forward"],
    ] as const
  ).filter(([ms, what]) => pace.due(what, ms));
  expect(announced).toEqual([
    [0, "forward"],
    [3000, "left"],
    [6200, "forward"],
  ]);
});

const BARE = { word: "c0280000", tag: 0, check: 0, car: 3, t_ms: 65_000 };
const TAGGED = { ...BARE, tag: 5, check: 28 };

it("shows the word, the sender and the time of the last frame", async () => {
  await changeLanguage("en");
  expect(lastFrameText(BARE)).toBe("Heard last: C0280000 from car 3 at 1:05.0");
});

it("names tag and check of a tagged frame, in both languages", async () => {
  await changeLanguage("en");
  expect(lastFrameText(TAGGED)).toBe("Heard last: C0280000 with tag 5 and check 28 from car 3 at 1:05.0");
  await changeLanguage("zh");
  expect(lastFrameText(TAGGED)).toBe("最近收到：C0280000，标签 5，校验码 28，来自小车 3，时间 1:05.0");
  expect(lastFrameText(BARE)).not.toContain("标签");
  await changeLanguage("en");
});
