import { afterAll, beforeEach, expect, it } from "vitest";
import texts from "virtual:texts/studio";
import type { CompiledWord, Profile } from "../api/types";
import { FORMATS } from "../generated/steps";
import { changeLanguage, startTexts } from "../i18n";
import { storyOf } from "./story";

await startTexts(texts);
beforeEach(() => changeLanguage("en"));
// Files of tests share the language.
afterAll(() => changeLanguage("en"));
const PROFILE = { durations_ms: [0, 1000, 2000, 3000], speeds_mm_s: [0, 100, 200, 300], turn_rates_deg_s: [0, 30, 60, 90], avoid_radii_mm: [100, 200, 300, 400] } as unknown as Profile;

function wordOf(values: Record<string, number>): CompiledWord {
  const bits = FORMATS.control.reduce((sum, { name, low }) => sum + (values[name] ?? 0) * 2 ** low, 0);
  return { hex: bits.toString(16).padStart(8, "0"), part: "leader", block: null };
}

const DRIVES = { motor_enable: 1, motor_duration: 3, motor_speed: 3 };

it.each<[string, Record<string, number>]>([
  ["drive · forward · fast · 3 s", DRIVES],
  ["drive · left · slow · 3 s", { ...DRIVES, motor_direction: 1, motor_speed: 1 }],
  ["wait · 3 s", { ...DRIVES, motor_speed: 0 }],
  ["follow the line · fast · 3 s", { ...DRIVES, floor: 1 }],
  ["turn left to the line · fast · 3 s", { ...DRIVES, motor_direction: 1, floor: 1 }],
  ["turn right to the line · medium · 3 s", { ...DRIVES, motor_direction: 2, motor_speed: 2, floor: 1 }],
  ["drive · random forward · fast · 3 s · unless dark floor", { ...DRIVES, motor_direction: 3, floor: 1 }],
  ["wait · 3 s + mind the floor", { ...DRIVES, motor_speed: 0, floor: 1 }],
  ["drive · forward · fast · 3 s · unless 'stop' or a person", { ...DRIVES, voice: 1, pir: 1 }],
  ["drive · forward · fast · 3 s · turn away · close", { ...DRIVES, avoid_enable: 1, avoid_radius: 1, avoid_duration: 3 }],
  ["drive · forward · fast · 3 s + avoid · close · 1 s", { ...DRIVES, avoid_enable: 1, avoid_radius: 1, avoid_duration: 1 }],
  ["wait · 3 s + watch for people", { ...DRIVES, motor_speed: 0, pir: 1 }],
  ["stand still", {}],
  ["stand still", { led_which: 2 }],
])("a word's story is '%s'", (story, values) => {
  expect(storyOf(wordOf(values), PROFILE)).toBe(story);
});

it.each([
  ["a jump", "80320000", "if a person: go to word 4"],
  ["a jump where something isn't so", "8021a000", "if not something within 20 cm: go to word 3"],
  ["a jump that asks a counter", "80154802", "if counter 2 is above 1: go to word 2"],
  ["a call", "90300000", "do word 4, then come back"],
  ["a return", "a0000000", "go back"],
  ["a count", "b0001006", "counter 3 = 3"],
  ["a count that takes away", "b0004002", "counter 1 − 1"],
  ["a tell", "c0100000", "tell: followers' word 2"],
  ["a tell in turn", "cff00000", "tell: the followers' words in turn"],
  ["a state that a condition ends", "65800080", "drive · forward · medium · 3 s · until something within 10 cm"],
  ["a state that the end of one ends", "618001c0", "wait · 3 s · while 'stop' was said"],
])("the story of %s", (_, hex, story) => expect(storyOf({ hex, part: "leader", block: null }, PROFILE)).toBe(story));

it("tells of lamps and of keeping away", () => {
  expect(storyOf(wordOf({ led_which: 1, led_duration: 2 }), PROFILE)).toMatch(/^light · .+ · 2 s$/);
  expect(storyOf(wordOf({ avoid_enable: 1, avoid_radius: 1, avoid_duration: 1 }), PROFILE)).toMatch(/^avoid · .+ · 1 s$/);
});

it("tells it in Chinese too", async () => {
  await changeLanguage("zh");
  expect(storyOf(wordOf({ ...DRIVES, motor_direction: 1, floor: 1 }), PROFILE)).toBe("左转到线上 · 快 · 3 秒");
});
