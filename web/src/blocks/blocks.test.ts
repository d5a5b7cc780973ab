import * as Blockly from "blockly/core";
import { beforeAll, describe, expect, it } from "vitest";
import texts from "virtual:texts/studio";
import type { EditorName, Profile } from "../api/types";
import { startTexts } from "../i18n";
import { useSettings } from "../state/settings";
import { refusal, typesIn } from "./clipboard";
import { DECIDING_BLOCKS } from "./deciding";
import { defineBlocks, canStandIn, toolboxOf } from "./definitions";
import { fitEnds, offerEnds } from "./endings";
import { nameOf } from "./names";
import { EMPTY_FOLLOWERS } from "./workspaces";

const profile = {
  speeds_mm_s: [0, 100, 200, 300],
  turn_rates_deg_s: [0, 30, 60, 90],
  avoid_radii_mm: [100, 200, 300, 400],
  durations_ms: [0, 1000, 2000, 3000],
  dwell_ms: [1000, 2000, 3000],
  seconds: { least: 1, step: 1, most: 765 },
} as Profile;

beforeAll(async () => {
  useSettings.setState({ level: "words" });
  await startTexts(texts);
  defineBlocks(profile);
});

/** The types of blocks in an editor's toolbox, the followers' unless another is given. */
const offered = (steps?: string[], editor: EditorName = "followers") =>
  toolboxOf(editor, steps).contents.flatMap(({ contents }) => contents.flatMap((item) => ("type" in item ? [item.type] : [])));

/** The fields that a new block of the type is saved with. */
function saved(type: string): unknown {
  const block = new Blockly.Workspace().newBlock(type);
  return (Blockly.serialization.blocks.save(block) as { fields?: unknown }).fields;
}

describe("the blocks", () => {
  it.each([
    ["motorcade_leader", undefined],
    ["motorcade_followers", { ACCEPT_IR: true, FORWARD: false, TAGGED: "auto", DWELL: "auto" }],
    ["motorcade_drive", { DIRECTION: "forward", SPEED: "2", SECONDS: 1 }],
    ["motorcade_wait", { SECONDS: 1 }],
    ["motorcade_led", { WHICH: "0", SECONDS: 1 }],
    ["motorcade_avoid", { RADIUS: "0", SECONDS: 1 }],
    ["motorcade_voice", { SECONDS: 1 }],
    ["motorcade_pir", { SECONDS: 1 }],
    ["motorcade_together", undefined],
    ["motorcade_repeat", { TIMES: 2 }],
    ["motorcade_infrared", { ACCEPT_IR: "same", FORWARD: "same" }],
    ["motorcade_if", undefined],
    ["motorcade_set", { COUNTER: "laps", TO: 0 }],
    ["motorcade_set_random", { COUNTER: "laps", RANDOM: 6 }],
    ["motorcade_change", { COUNTER: "laps", BY: 1 }],
    ["motorcade_do", { NAME: "dance" }],
    ["motorcade_flow", { OP: "jump", TARGET: 0, CONDITION: "always", IF_NOT: 0, LEVEL: 0, COUNTER: 0, VALUE: 0 }],
    ["motorcade_when_obstacle", { LEVEL: "0" }],
    ["motorcade_when_voice", { COMMAND: "stop" }],
    ["motorcade_when_floor", { WHERE: "either" }],
    ["motorcade_when_chance", { PERCENT: 50 }],
    ["motorcade_when_counter", { COUNTER: "laps", IS: "is", VALUE: 3 }],
  ])("%s is saved as the server reads it", (type, fields) => expect(saved(type)).toEqual(fields));

  it("keep what they are loaded with, even seconds that no car can do", () => {
    const workspace = new Blockly.Workspace();
    const drive = { type: "motorcade_drive", id: "drive", fields: { DIRECTION: "left", SPEED: "3", SECONDS: 0.5 } };
    const state = { blocks: { languageVersion: 0, blocks: [{ type: "motorcade_leader", id: "hat", x: 24, y: 24, next: { block: drive } }] } };
    Blockly.serialization.workspaces.load(state, workspace);
    expect(Blockly.serialization.workspaces.save(workspace)).toMatchObject(state);
  });

  it.each([
    ["2,5", 2.5],
    ["２．５", 2.5],
    [" 4 ", 4],
    ["", 1],
    ["三", 1],
    ["🚗", 1],
  ])("take typed seconds as people write them: %j", (typed, value) => {
    const block = new Blockly.Workspace().newBlock("motorcade_wait");
    block.setFieldValue(typed, "SECONDS");
    expect(block.getFieldValue("SECONDS")).toBe(value);
  });

  it("let the followers' hat of an older project decide by itself whether words are tagged", () => {
    const workspace = new Blockly.Workspace();
    const fields = { ACCEPT_IR: "TRUE", FORWARD: "TRUE", DWELL: "2" };
    Blockly.serialization.workspaces.load({ blocks: { blocks: [{ type: "motorcade_followers", fields }] } }, workspace);
    const [hat] = workspace.getTopBlocks();
    expect(["FORWARD", "TAGGED", "DWELL"].map((name) => hat!.getFieldValue(name) as unknown)).toEqual(["TRUE", "auto", "2"]);
  });

  it("say a turn's speed as an angle", () => {
    const block = new Blockly.Workspace().newBlock("motorcade_drive");
    expect(block.getField("SPEED")!.getText()).toContain("200");
    block.setFieldValue("left", "DIRECTION");
    expect(block.getField("SPEED")!.getText()).toContain("60");
  });

  it.each([
    ["forward", "3", 1, ""],
    ["left", "3", 1, "a quarter turn"],
    ["right", "1", 6, "half a turn"],
    ["left", "2", 1, "60°"],
  ])("say how far a turn goes: %s at speed %s for %i s", (direction, speed, seconds, told) => {
    const block = new Blockly.Workspace().newBlock("motorcade_drive");
    for (const [name, value] of Object.entries({ DIRECTION: direction, SPEED: speed, SECONDS: seconds })) block.setFieldValue(value, name);
    expect(block.getField("TURN")!.getText()).toBe(told);
    block.setFieldValue("until", "ENDS");
    expect(block.getField("TURN")!.getText()).toBe("");
  });

  it("are all to be had from a toolbox, but for the hats", () => {
    const all = new Set([...offered(), ...offered(undefined, "leader")]);
    expect([...all].sort()).toEqual(Object.keys(Blockly.Blocks).filter((type) => !/leader|followers|flow$/.test(type)).sort());
    expect(canStandIn("leader", "motorcade_infrared")).toBe(false);
  });

  it("are few on the first level, tell speeds in words, and are saved alike", () => {
    const before = Object.keys(Blockly.Blocks).map(saved);
    useSettings.setState({ level: "start" });
    const few = offered();
    const drive = new Blockly.Workspace().newBlock("motorcade_drive");
    const [speed, figure] = [drive.getField("SPEED")!.getText(), drive.getField("SPEED")!.getTooltip()];
    const now = Object.keys(Blockly.Blocks).map(saved);
    useSettings.setState({ level: "words" });
    expect(few).toHaveLength(5);
    expect([speed, figure]).toEqual(["medium", "200 mm/s"]);
    expect(now).toEqual(before);
  });

  it("let followers pass words on, with a switch that the first level shows too", () => {
    const workspace = new Blockly.Workspace();
    Blockly.serialization.workspaces.load(EMPTY_FOLLOWERS, workspace);
    expect(workspace.getTopBlocks()[0]!.getFieldValue("FORWARD")).toBe("TRUE");
    const isShown = (name: string) => {
      const block = new Blockly.Workspace().newBlock("motorcade_followers");
      return block.inputList.some((input) => input.isVisible() && input.fieldRow.some((field) => field.name === name));
    };
    const names = ["FORWARD", "ACCEPT_IR", "TAGGED", "DWELL"];
    useSettings.setState({ level: "start" });
    const first = names.map(isShown);
    useSettings.setState({ level: "words" });
    expect(first).toEqual([true, false, false, false]);
    expect(names.map(isShown)).toEqual([true, true, true, true]);
  });

  it("of a mission are those that it names, on the first level too", () => {
    const types = () => offered(["drive", "wait"]);
    useSettings.setState({ level: "start" });
    const first = types();
    useSettings.setState({ level: "words" });
    expect(first).toEqual(["motorcade_drive", "motorcade_wait"]);
    expect(types()).toEqual(["motorcade_drive", "motorcade_wait", "motorcade_infrared"]);
  });

  it("of a leader that decides are few on the first level, and in a mission those whose kinds it allows", () => {
    const decides = (steps?: string[]) => offered(steps, "leader").filter((type) => type in DECIDING_BLOCKS).map((type) => type.slice(10));
    useSettings.setState({ level: "start" });
    const first = decides();
    useSettings.setState({ level: "words" });
    expect(first).toEqual(["wait_until", "if", "if_else", "when_obstacle", "when_person", "when_voice", "when_floor"]);
    expect(decides(["drive", "repeat", "wait"])).toEqual([]);
    expect(decides(["drive", "change"])).toEqual(["change"]);
    expect(decides(["if", "repeat"]).slice(0, 4)).toEqual(["if", "if_else", "repeat_until", "forever"]);
  });

  it("name a lamp by its colour on every level", () => {
    const lamp = () => new Blockly.Workspace().newBlock("motorcade_led").getField("WHICH")!.getText();
    expect(lamp()).toBe("0 · yellow");
    useSettings.setState({ level: "start" });
    expect(lamp()).toBe("yellow");
    useSettings.setState({ level: "words" });
  });
});

describe("what ends a step", () => {
  const shown = (block: Blockly.Block) => block.inputList.filter((input) => input.isVisible() && input.name).map(({ name }) => name);
  const condition = (workspace: Blockly.Workspace) => workspace.newBlock("motorcade_when_person").outputConnection!;

  it("is its time, until another end is chosen", () => {
    const block = new Blockly.Workspace().newBlock("motorcade_drive");
    const states = ["time", "until", "both", "time"].map((way) => {
      block.setFieldValue(way, "ENDS");
      return shown(block);
    });
    expect(states).toEqual([["TIME"], ["BREAK", "ENDS_ROW", "UNTIL"], ["TIME", "BREAK", "ENDS_ROW", "UNTIL"], ["TIME", "ENDS_ROW"]]);
  });

  it("can be chosen only where conditions are", () => {
    const block = new Blockly.Workspace().newBlock("motorcade_wait");
    const ways = [true, false].map((asks) => {
      offerEnds(() => ({ asks, minded: [], shows: true }));
      fitEnds(block);
      return shown(block).includes("ENDS_ROW");
    });
    expect(ways).toEqual([true, false]);
  });

  it("takes its condition along, and brings it back when that is undone", () => {
    const workspace = new Blockly.Workspace();
    const block = workspace.newBlock("motorcade_led");
    block.setFieldValue("until", "ENDS");
    block.getInput("UNTIL")!.connection!.connect(condition(workspace));
    Blockly.Events.setGroup(true);
    block.setFieldValue("time", "ENDS");
    Blockly.Events.setGroup(false);
    expect(workspace.getAllBlocks(false)).toHaveLength(1);
    expect(Blockly.serialization.blocks.save(block)).not.toHaveProperty("inputs");
  });

  it("takes nothing where it is hidden", () => {
    const workspace = new Blockly.Workspace();
    const gap = workspace.newBlock("motorcade_drive").getInput("UNTIL")!.connection!;
    expect(gap.getConnectionChecker().canConnect(gap, condition(workspace), false)).toBe(false);
  });

  it("is that of the together around it", () => {
    const workspace = new Blockly.Workspace();
    const together = workspace.newBlock("motorcade_together");
    const drive = workspace.newBlock("motorcade_drive");
    drive.setFieldValue("both", "ENDS");
    drive.getInput("UNTIL")!.connection!.connect(condition(workspace));
    together.getInput("STEPS")!.connection!.connect(drive.previousConnection!);
    fitEnds(together);
    expect([drive.getFieldValue("ENDS"), shown(drive)]).toEqual(["time", ["TIME"]]);
    together.setFieldValue("until", "ENDS");
    fitEnds(together);
    expect(shown(drive)).toEqual([]);
  });
});

describe("names", () => {
  it.each([
    ["laps", "laps"],
    [" my laps ", "my_laps"],
    ["圈数", "圈数"],
    ["3 laps!", "_laps"],
    ["ｌａｐｓ", "laps"],
    ["!?", null],
  ])("that are typed become names that Python takes: %j", (typed, name) => expect(nameOf(typed)).toBe(name));
});

describe("pasting", () => {
  const inRepeat = (type: string) => ({
    type: "motorcade_repeat",
    inputs: { STEPS: { block: { type: "motorcade_wait", next: { block: { type } } } } },
  });

  it("looks at every block inside and below", () => {
    expect([...typesIn(inRepeat("motorcade_led"))]).toEqual(["motorcade_repeat", "motorcade_wait", "motorcade_led"]);
  });

  it("refuses the leader infrared, and each editor another's beginning, with the reason", () => {
    expect(refusal("leader", inRepeat("motorcade_infrared"))).toBe("clipboard.leaderInfrared");
    expect(refusal("followers", inRepeat("motorcade_infrared"))).toBeNull();
    expect(refusal("leader", { type: "motorcade_followers" })).toBe("clipboard.hat");
    expect(refusal("leader", inRepeat("motorcade_drive"))).toBeNull();
    expect(refusal("followers", inRepeat("motorcade_if"))).toBe("clipboard.leaderOnly");
    expect(refusal("followers", { type: "motorcade_drive", fields: { ENDS: "until" } })).toBe("clipboard.leaderOnly");
    expect(refusal("leader", { type: "motorcade_drive", fields: { ENDS: "until" } })).toBeNull();
  });
});
