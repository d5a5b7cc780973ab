import { CompletionContext } from "@codemirror/autocomplete";
import { python } from "@codemirror/lang-python";
import { EditorState } from "@codemirror/state";
import { beforeAll, expect, it } from "vitest";
import texts from "virtual:texts/studio";
import type { Profile } from "../api/types";
import { startTexts } from "../i18n";
import { completeAt } from "./completion";

const PROFILE = {
  durations_ms: [0, 1000, 2000, 3000],
  speeds_mm_s: [0, 100, 200, 300],
  turn_rates_deg_s: [0, 45, 90, 135],
  avoid_radii_mm: [100, 200, 300, 400],
} as Profile;

beforeAll(() => startTexts(texts));

/** What is offered at the bar in a text. */
function offered(text: string, explicit = false): string[] {
  const at = text.indexOf("|");
  const state = EditorState.create({ doc: text.replace("|", ""), extensions: python() });
  const result = completeAt(new CompletionContext(state, at, explicit), PROFILE);
  const word = state.sliceDoc(result?.from ?? at, at);
  return (result?.options ?? []).map(({ label }) => label).filter((label) => label.startsWith(word));
}

const NAMES = ["forward", "left", "right", "wander", "wait", "led", "avoid", "voice", "pir", "follow_line", "turn_left_to_line", "turn_right_to_line", "floor", "repeat", "together"];

it.each([
  ["program = Program(leader=[\n    fo|\n])", ["forward", "follow_line"]],
  ["program = Program([forward(3), l|])", ["left", "led"]],
  ["led(|", ["0", "1", "2", "3", "which=", "seconds="]],
  ["[led(1, |)]", ["1", "2", "3", "seconds="]],
  ["[forward(2, sp|), left(1)]", ["speed="]],
  ["[forward(2, speed=|), left(1)]", ["0", "1", "2", "3"]],
  ["[forward(speed=1, |", ["seconds=", "unless="]],
  ["[forward(3, un|)]", ["unless="]],
  ["[led(1, un|)]", []],
  ["[forward(3, unless=|)]", ["person()", "heard()", "obstacle(1)"]],
  ["together(forward(1), le|)", ["left", "led"]],
  ["together(forward(1, s|", ["speed="]],
  ["together(re|)", []],
  ["together(voice(|))", []],
  ["repeat(3, to|)", ["together"]],
  ["repeat(2, together(led(which=|", ["0", "1", "2", "3"]],
  ["repeat(times=|", []],
  ["Followers([wait(1, acc|)])", ["accept_ir="]],
  ["Program([], followers=[wait(1, forward=|)])", ["True", "False"]],
  ["Program([wait(1, acc|)])", []],
])("in %s it offers %j", (text, options) => expect(offered(text)).toEqual(options));

it.each(["[forward(3),\n|]", "# fo|", "'fo|'", "from motorcade import fo|", "wait(1)|", "motorcade.fo|"])("in %s nothing is in the way", (text) =>
  expect(offered(text)).toEqual([]),
);

it("shows all names where it is asked to", () => expect(offered("[|]", true)).toEqual(NAMES));
