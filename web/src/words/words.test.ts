import { describe, expect, it } from "vitest";
import type { CompiledWord, Field } from "../api/types";
import { FORMATS } from "../generated/steps";
import { bitsOf, blockOf, fieldsOf, isLit, runsOf, sharedWords, spansOf, wordsCsv } from "./bits";
import { askedKey } from "./deciding";

const NAMES: readonly string[] = ["accept_ir", "motor_enable", "motor_direction", "led_which", "reserved", "parity"];
const control: readonly Field[] = FORMATS.control.filter(({ name }) => NAMES.includes(name));
const word: CompiledWord = {
  hex: "b0200001",
  part: "followers",
  block: "together",
  fields_of: { motor_enable: "drive", motor_direction: "drive", led_which: "led" },
};

describe("bits", () => {
  it("stand where the format says, the most significant first", () => {
    expect(control.map((each) => bitsOf(word, each))).toEqual(["1", "1", "10", "01", "0000000000", "1"]);
  });

  it("are 32, in two halves that no field crosses", () => {
    for (const part of ["header", "followers"] as const) {
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
    expect(lines[1]).toBe("0,followers,0xB0200001,10110000001000000000000000000001,,,,1,0,1,2,0,0,1,0,0,0,0,0,0,0,0,1");
    expect(lines[2]).toBe("");
  });

  it("has columns for conditions and flow words where there are any", () => {
    const leads = { part: "leader", block: null } as const;
    // A jump to the third word if a person is near, and a drive until something is near.
    const [head, jump, drive] = wordsCsv([{ ...leads, hex: "80220000" }, { ...leads, hex: "648000d0" }]).split("\r\n");
    expect(head).toMatch(/,flow,op,target,condition,if_not,level,counter,value,unused,until,until_not,until_level$/);
    expect(jump).toMatch(/,1,0,2,2,0,0,0,0,0,,,$/);
    expect(drive).toMatch(/,0,,,,,,,,,1,1,1$/);
  });
});

describe("the words of a leader that decides", () => {
  const step = { part: "leader", block: "step" } as const;
  const named = (each: CompiledWord, ...blocks: string[]) => fieldsOf(each).filter((field) => isLit(each, field, new Set(blocks))).map(({ name }) => name);

  it("have the fields of their kind", () => {
    expect(fieldsOf({ ...step, hex: "80220000" })[1]!.name).toBe("op");
    expect(fieldsOf({ ...step, hex: "648000d0" }).at(-2)!.name).toBe("until_level");
    expect(fieldsOf({ ...step, hex: "64800000" }).at(-1)!.name).toBe("parity");
    expect(fieldsOf({ ...step, part: "followers", hex: "f4800000" }).at(-1)!.name).toBe("parity");
  });

  it("light up the bits of a condition with its block alone", () => {
    const asked = { kind: "obstacle", level: 1 } as const;
    expect(named({ ...step, hex: "648000d0" }, askedKey("step", asked))).toEqual(["until", "until_not", "until_level"]);
    expect(named({ ...step, hex: "80212000" }, askedKey("step", asked))).toEqual(["condition", "if_not", "level", "counter", "value"]);
    expect(named({ ...step, hex: "80214000" }, askedKey("step", asked))).toEqual([]);
  });
});
