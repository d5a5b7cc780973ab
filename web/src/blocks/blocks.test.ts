import * as Blockly from "blockly/core";
import { beforeAll, describe, expect, it } from "vitest";
import texts from "virtual:texts/studio";
import type { Profile } from "../api/types";
import { startTexts } from "../i18n";
import { FIRST_STEPS } from "../projects/project";
import { useSettings } from "../state/settings";
import { refusal, typesIn } from "./clipboard";
import { defineBlocks, canStandIn, toolboxOf } from "./definitions";
import { emptyState } from "./workspaces";

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

/** The types of blocks in the followers' toolbox. */
const offered = (steps?: string[]) =>
  toolboxOf("followers", steps).contents.flatMap(({ contents }) => contents.flatMap((item) => ("type" in item ? [item.type] : [])));

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
  ])("%s is saved as the server reads it", (type, fields) => expect(saved(type)).toEqual(fields));

  it("keep what they are loaded with, even seconds that no car can do", () => {
    const workspace = new Blockly.Workspace();
    const state = structuredClone(FIRST_STEPS.leader) as { blocks: { blocks: { next: { block: { fields: object } } }[] } };
    state.blocks.blocks[0]!.next.block.fields = { DIRECTION: "left", SPEED: "3", SECONDS: 0.5 };
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

  it("are all to be had from a toolbox, but for the hats", () => {
    expect(offered().sort()).toEqual(Object.keys(Blockly.Blocks).filter((type) => !/leader|followers/.test(type)).sort());
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
    expect(few).toHaveLength(6);
    expect([speed, figure]).toEqual(["medium", "200 mm/s"]);
    expect(now).toEqual(before);
  });

  it("let followers pass words on, with a switch that the first level shows too", () => {
    const workspace = new Blockly.Workspace();
    Blockly.serialization.workspaces.load(emptyState("followers"), workspace);
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
    const types = () => offered(["drive", "pir"]);
    useSettings.setState({ level: "start" });
    const first = types();
    useSettings.setState({ level: "words" });
    expect(first).toEqual(["motorcade_drive", "motorcade_pir"]);
    expect(types()).toEqual(["motorcade_drive", "motorcade_pir", "motorcade_infrared"]);
  });

  it("name a lamp by its colour on every level", () => {
    const lamp = () => new Blockly.Workspace().newBlock("motorcade_led").getField("WHICH")!.getText();
    expect(lamp()).toBe("0 · yellow");
    useSettings.setState({ level: "start" });
    expect(lamp()).toBe("yellow");
    useSettings.setState({ level: "words" });
  });
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
  });
});
