import { describe, expect, it } from "vitest";
import type { CompiledWord, Field } from "../api/types";
import { FORMATS } from "../generated/steps";
import { bitsOf, blockOf, isLit, runsOf, sharedWords, spansOf, wordsCsv } from "./bits";

const NAMES: readonly string[] = ["accept_ir", "motor_enable", "motor_direction", "led_which", "reserved", "parity"];
const control: readonly Field[] = FORMATS.control.filter(({ name }) => NAMES.includes(name));
const word: CompiledWord = {
  hex: "b0200001",
  part: "leader",
  block: "together",
  fields_of: { motor_enable: "drive", motor_direction: "drive", led_which: "led" },
};

describe("bits", () => {
  it("stand where the format says, the most significant first", () => {
    expect(control.map((each) => bitsOf(word, each))).toEqual(["1", "1", "10", "01", "0000000000", "1"]);
  });

  it("are 32, in two halves that no field crosses", () => {
    for (const part of ["header", "leader"] as const) {
      const runs = runsOf({ ...word, part });
      expect(parseInt(runs.map(({ bits }) => bits).join(""), 2)).toBe(0xb0200001);
      expect(runs.filter(({ field: { low } }) => low >= 16).map(({ bits }) => bits).join("")).toHaveLength(16);
    }
  });

  it("belong to the block of their field, else to the word's", () => {
    expect(blockOf(word, "motor_direction")).toBe("drive");
    expect(blockOf(word, "accept_ir")).toBe("together");
  });

  it("light up with their own block only, and reserved ones never", () => {
    const lit = (...blocks: string[]) => control.filter((field) => isLit(word, field, new Set(blocks))).map(({ name }) => name);
    expect(lit("led")).toEqual(["led_which"]);
    expect(lit("drive", "together")).toEqual(["accept_ir", "motor_enable", "motor_direction"]);
    expect(lit()).toEqual([]);
  });

  it("are named in runs of one colour", () => {
    expect(spansOf(control).map(({ group, fields }) => [group, fields.length])).toEqual([
      ["infrared", 1],
      ["motor", 2],
      ["led", 1],
      ["reserved", 1],
      ["parity", 1],
    ]);
  });
});

describe("words after an edit", () => {
  it("are the same objects where they are the same words of the same blocks", () => {
    const now = [structuredClone(word), { ...word, hex: "b0200003" }, { ...word, block: "other" }, structuredClone(word)];
    const shared = sharedWords([word, word, word], now);
    expect(shared).toEqual(now);
    expect(shared.map((each) => each === word)).toEqual([true, false, false, false]);
  });
});

describe("the word table as CSV", () => {
  it("has a column for each field and a line for each word", () => {
    const lines = wordsCsv([word]).split("\r\n");
    expect(lines[0]).toBe([
      "index,part,hex,bits,leader_states,follower_words,dwell,accept_ir,forward,motor_enable,motor_direction,motor_speed,motor_duration",
      "led_which,led_duration,avoid_enable,avoid_radius,avoid_duration,voice,pir,floor,reserved,parity",
    ].join());
    expect(lines[1]).toBe("0,leader,0xB0200001,10110000001000000000000000000001,,,,1,0,1,2,0,0,1,0,0,0,0,0,0,0,0,1");
    expect(lines[2]).toBe("");
  });
});
