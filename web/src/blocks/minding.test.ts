import * as Blockly from "blockly/core";
import { beforeAll, describe, expect, it } from "vitest";
import texts from "virtual:texts/studio";
import type { Profile } from "../api/types";
import type { Mat } from "../generated/world";
import { startTexts } from "../i18n";
import { useSettings } from "../state/settings";
import { defineBlocks, stepsFor, toolboxOf } from "./definitions";
import { fitEnds, offerEnds } from "./endings";

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

describe("what a drive minds", () => {
  const driving = () => new Blockly.Workspace().newBlock("motorcade_drive");
  const said = (block: Blockly.Block) => {
    const rows = block.inputList.filter((input) => input.isVisible() && input.name.startsWith("UNLESS"));
    return rows.flatMap(({ fieldRow }) => fieldRow.map((field) => field.getText())).join();
  };
  const menu = (block: Blockly.Block) => (block.getField("ENDS") as Blockly.FieldDropdown).getOptions(false).map(([, value]) => value);

  it("is chosen in its small field, one thing beside another", () => {
    offerEnds(() => ({ asks: false, minded: ["pir", "avoid", "floor"], shows: true }));
    const block = driving();
    fitEnds(block);
    const steps = [[said(block), menu(block)]];
    for (const kind of ["unless pir", "unless avoid"]) {
      block.setFieldValue(kind, "ENDS");
      fitEnds(block);
      steps.push([said(block), menu(block)]);
    }
    // Nothing is left to choose: the field keeps the ends that the block could have.
    expect(steps).toEqual([
      ["", ["unless pir", "unless avoid"]],
      ["unless", ["unless avoid"]],
      ["mind:", ["time", "until", "both"]],
    ]);
    expect(Blockly.serialization.blocks.save(block)).toMatchObject({
      fields: { DIRECTION: "forward" },
      inputs: { UNLESS: { block: { type: "motorcade_when_any", inputs: { OF0: { block: { type: "motorcade_when_person" } } } } } },
    });
  });

  it("holds a random drive on dark floor, and turns a car away from what is near", () => {
    offerEnds(() => ({ asks: false, minded: ["avoid", "floor"], shows: true }));
    const block = driving();
    block.setFieldValue("random", "DIRECTION");
    expect(menu(block)).toEqual(["unless avoid", "unless floor"]);
    block.setFieldValue("unless avoid", "ENDS");
    fitEnds(block);
    expect(said(block)).toBe("turn away from what is");
  });

  it("is nothing that a car can't mind", () => {
    const workspace = new Blockly.Workspace();
    const socket = workspace.newBlock("motorcade_drive").getInput("UNLESS")!.connection!;
    const fits = (type: string) => socket.getConnectionChecker().canConnect(socket, workspace.newBlock(type).outputConnection, false);
    expect(["person", "any", "chance", "not"].map((kind) => fits(`motorcade_when_${kind}`))).toEqual([true, true, false, false]);
  });
});

describe("the palette", () => {
  it.each<[string, object, string]>([
    ["a road", { line: [{}] }, "motorcade_follow_line"],
    ["a person", { person: [{}] }, "motorcade_when_person"],
    ["a voice", { voice: [{}] }, "motorcade_when_voice"],
    ["a wall", { wall: [{}] }, "motorcade_when_obstacle"],
    ["dark floor", { spot: [{}] }, "motorcade_when_floor"],
  ])("has more on the first level where %s is on the stage", (_, mat, wanted) => {
    useSettings.setState({ level: "start" });
    const all = (staged: string[]) => JSON.stringify(toolboxOf("followers", null, staged));
    const [without, withIt] = [all([]), all(stepsFor(mat as Mat))];
    useSettings.setState({ level: "words" });
    expect(without).not.toContain(wanted);
    expect(withIt).toContain(wanted);
  });

  it("of a mission has a drive that minds what it allows, and no block that needs a together beside it", () => {
    const contents = (steps: string[]) => JSON.stringify(toolboxOf("leader", steps));
    expect(contents(["follow_line", "pir"])).toContain('"motorcade_follow_line","fields":{},"inputs":{"UNLESS"');
    expect(contents(["follow_line", "pir"])).not.toContain("motorcade_pir");
    expect(contents(["follow_line", "pir", "together"])).toContain("motorcade_pir");
  });
});
