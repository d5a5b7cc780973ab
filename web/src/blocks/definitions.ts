/** What Blockly needs of the page: a block for each kind of step, the drawers of each editor, and its messages. */

import * as Blockly from "blockly/core";
import type { Profile, EditorName } from "../api/types";
import { STEP_KINDS, CATEGORIES, HAT_IN_START } from "../generated/steps";
import { say, type Texts, textsOf } from "../i18n";
import { useSettings } from "../state/settings";
import { levelText, plainSeconds, secondsMeaning } from "./figures";
import { IconField, iconOf, SecondsField, SpeedField, speedsOf } from "./fields";
import { pictureAbove } from "./drawers";

type Option = [string, string];
type Field = Record<string, unknown>;
type StepKind = (typeof STEP_KINDS)[number];
type StepField = StepKind["fields"][number];

const HIDDEN = "HIDDEN";
/** Enough for any program: a car holds 255 states. */
const MOST_TIMES = 1000;

interface Definition {
  /** The key of the block's text, and of its tooltip. */
  message: keyof Texts["tooltips"] & keyof Texts["blocks"];
  style: string;
  fields?: (profile: Profile) => Field[];
  /** Fields that stand at the end and are not always shown. */
  tail?: (profile: Profile) => Field[];
  holds?: boolean;
  hat?: boolean;
}

/** Whether the page shows few kinds of blocks, and words in place of figures. */
const isStart = () => useSettings.getState().level === "start";

const dropdown = (name: string, options: Option[] | (() => Option[])): Field => ({ type: "field_dropdown", name, options });
const seconds = (profile: Profile): Field => ({
  type: SecondsField.KIND,
  name: "SECONDS",
  value: Math.max(profile.seconds.least, profile.seconds.step),
  ...profile.seconds,
});

const choices = (options: readonly (keyof Texts["blocks"])[]) => options.map((option): Option => [say(`blocks.${option}`), option]);
const dwells = (profile: Profile) => (): Option[] => [
  [say("blocks.dwellAuto"), "auto"],
  ...profile.dwell_ms.map((dwell): Option => [secondsMeaning(dwell), plainSeconds(dwell)]),
];
const taggedChoices = (): Option[] => [[say("blocks.taggedAuto"), "auto"], ...choices(["yes", "no"])];
const infraredChoices = () => choices(["same", "yes", "no"]);
const checkbox = (name: string, checked: boolean): Field => ({ type: "field_checkbox", name, checked });

/** The input of a step's field, as its declaration has it. */
function inputOf(field: StepField, profile: Profile): Field {
  switch (field.input) {
    case "seconds":
      return seconds(profile);
    case "choice":
      return dropdown(field.name, () => choices(field.options));
    case "number":
      return { type: "field_number", name: field.name, value: field.first, min: field.minimum, max: MOST_TIMES, precision: 1 };
    case "level":
      if (field.menu === "speed") return { type: SpeedField.KIND, name: field.name, options: speedsOf(profile), first: String(field.first) };
      return {
        ...dropdown(field.name, () => field.levels.map((level): Option => [levelText(profile, field.menu, level, isStart()), String(level)])),
        tooltip: field.levels.map((level) => levelText(profile, field.menu, level)).join(" · "),
      };
  }
}

/** The block of a kind of step. A step that accompanies others shows its seconds at the end, and only outside a together. */
function definitionOf({ kind, category, accompanies, holds, fields }: StepKind): Definition {
  const inputs = (profile: Profile) => fields.map((field) => inputOf(field, profile));
  return { message: kind, style: category, holds, ...(accompanies ? { tail: inputs } : { fields: inputs }) };
}

const DEFINITIONS: Record<string, Definition> = {
  motorcade_leader: { message: "leader", style: "hat", hat: true },
  motorcade_followers: {
    message: "followers",
    style: "hat",
    hat: true,
    fields: (profile) => [
      checkbox("ACCEPT_IR", true),
      { ...checkbox("FORWARD", false), tooltip: say("tooltips.passOn") },
      { ...dropdown("TAGGED", taggedChoices), tooltip: say("tooltips.tagged") },
      dropdown("DWELL", dwells(profile)),
    ],
  },
  ...Object.fromEntries(STEP_KINDS.map((each) => [`motorcade_${each.kind}`, definitionOf(each)])),
  motorcade_infrared: {
    message: "infrared",
    style: "infrared",
    holds: true,
    fields: () => [dropdown("ACCEPT_IR", infraredChoices), dropdown("FORWARD", infraredChoices)],
  },
};

/** The definition as Blockly's JSON. */
function jsonOf(type: string, profile: Profile): Record<string, unknown> {
  const { message, style, fields, tail, holds, hat } = DEFINITIONS[type]!;
  const text = isStart() ? say(`startBlocks.${message}`) : say(`blocks.${message}`);
  const own = fields?.(profile) ?? [];
  // The first level shows few settings of infrared: the block keeps the others, unseen.
  const isShown = ({ name }: Field) => !(isStart() && hat) || HAT_IN_START.some((each) => each === name);
  const hidden = own.filter((field) => !isShown(field));
  const rows = [
    // The icon comes first, so every other field's number is one higher.
    { message: `%1 ${text.replace(/%(\d)/g, (_, number) => `%${Number(number) + 1}`)}`, fields: [iconOf(message), ...own.filter(isShown)] },
    ...(hidden.length
      ? [{ message: ["", ...hidden].map((_, number) => `%${number + 1}`).join(" "), fields: [...hidden, { type: "input_dummy", name: HIDDEN }] }]
      : []),
    ...(tail ? [{ message: say("blocks.tail"), fields: tail(profile) }] : []),
    ...(holds ? [{ message: "%1", fields: [{ type: "input_statement", name: "STEPS" }] }] : []),
  ];
  const numbered = rows.flatMap((row, index) => [
    [`message${index}`, row.message],
    [`args${index}`, row.fields],
  ]);
  return {
    type,
    ...(Object.fromEntries(numbered) as Record<string, unknown>),
    style: `${style}_blocks`,
    tooltip: say(`tooltips.${message}`),
    ...(hat ? {} : { previousStatement: null }),
    nextStatement: null,
    inputsInline: true,
  };
}

/** Inside a together, voice and PIR last as long as it does: their own seconds mean nothing there and are not shown. */
function hideSecondsInTogether(this: Blockly.Block): void {
  if (this.isInsertionMarker() || !(this instanceof Blockly.BlockSvg)) return;
  const shown = this.getSurroundParent()?.type !== "motorcade_together";
  const input = this.inputList.at(-1)!;
  if (input.isVisible() === shown) return;
  input.setVisible(shown);
  void this.queueRender();
}

/** Define the blocks for this profile and in the current language. */
export function defineBlocks(profile: Profile): void {
  for (const field of [SecondsField, SpeedField, IconField]) Blockly.registry.register(Blockly.registry.Type.FIELD, field.KIND, field, true);
  for (const [type, { tail, hat }] of Object.entries(DEFINITIONS)) {
    Blockly.Blocks[type] = {
      init(this: Blockly.Block) {
        this.jsonInit(jsonOf(type, profile));
        if (hat) this.setDeletable(false);
        this.getInput(HIDDEN)?.setVisible(false);
        if (type === "motorcade_drive") {
          SpeedField.followDirection(this);
          SpeedField.showFigures(this, profile);
        }
        if (tail) this.setOnChange(hideSecondsInTogether);
      },
    };
  }
}

const drawer = (category: (typeof CATEGORIES)[number]) =>
  STEP_KINDS.filter((each) => each.category === category).map(({ kind }) => `motorcade_${kind}`);
const START_BLOCKS: ReadonlySet<string> = new Set(STEP_KINDS.filter(({ in_start }) => in_start).map(({ kind }) => `motorcade_${kind}`));

const DRAWERS = {
  ...(Object.fromEntries(CATEGORIES.map((category) => [category, drawer(category)])) as Record<(typeof CATEGORIES)[number], string[]>),
  infrared: ["motorcade_infrared"],
};

/** A leader sends infrared and accepts none, so it has no block for it. */
const DRAWERS_OF: Record<EditorName, readonly (keyof typeof DRAWERS)[]> = {
  leader: CATEGORIES,
  followers: [...CATEGORIES, "infrared"],
};

export const hatOf = (editor: EditorName) => `motorcade_${editor}`;

/** Whether blocks of this type can stand in the editor at all. */
export function canStandIn(editor: EditorName, type: string): boolean {
  return DRAWERS_OF[editor].some((drawer) => DRAWERS[drawer].includes(type));
}

/** The drawers of an editor; with `steps`, those of a mission, only the blocks of these kinds are in them. */
export function toolboxOf(editor: EditorName, steps: readonly string[] | null = null) {
  const isShown = (type: string) => {
    if (type === "motorcade_infrared") return !isStart();
    return steps ? steps.includes(type.replace("motorcade_", "")) : !isStart() || START_BLOCKS.has(type);
  };
  return {
    kind: "categoryToolbox",
    contents: DRAWERS_OF[editor].filter((drawer) => DRAWERS[drawer].some(isShown)).map((drawer) => ({
      kind: "category",
      name: say(`drawers.${drawer}`),
      categorystyle: `${drawer}_category`,
      cssconfig: { icon: `drawer-icon drawer-${drawer}` },
      contents: DRAWERS[drawer].filter(isShown).flatMap((type) => [...pictureAbove(type), { kind: "block", type }]),
    })),
  };
}

/** Give Blockly its messages in the page's language. */
export const setBlocklyLanguage = () => Blockly.setLocale(textsOf("blockly"));
