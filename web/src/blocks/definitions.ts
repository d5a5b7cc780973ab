/** What Blockly needs of the page: a block for each kind of step, the drawers of each editor, and its messages. */

import * as Blockly from "blockly/core";
import type { Profile, EditorName } from "../api/types";
import type { Mat } from "../generated/world";
import { STEP_KINDS, CATEGORIES, HAT_IN_START } from "../generated/steps";
import { say, type Texts, textsOf } from "../i18n";
import { isStart } from "../state/settings";
import { DECIDING_BLOCKS, type Definition, type Field, figure, holdParts, menu, type Message, NEVER_OFFERED, type Option, STEPS } from "./deciding";
import { CONDITION_CHECK, EndsField, endsInputs, followEnds, TIME } from "./endings";
import { levelText, plainSeconds, secondsMeaning } from "./figures";
import { NameField } from "./names";
import { type BlockIcon, IconField, iconOf, SecondsField, SpeedField, speedsOf, TurnField } from "./fields";
import { pictureAbove } from "./drawers";
import { isMinded, MINDED_CHECK, MINDED_KINDS, mindingBlock } from "./minding";

type StepKind = (typeof STEP_KINDS)[number];
type StepField = StepKind["fields"][number];

const HIDDEN = "HIDDEN";
/** Enough for any program: a car holds 255 states. */
const MOST_TIMES = 1000;

const seconds = (profile: Profile): Field => ({
  type: SecondsField.KIND,
  name: "SECONDS",
  value: Math.max(profile.seconds.least, profile.seconds.step),
  ...profile.seconds,
});

const choices = (options: readonly Message[]) => options.map((option): Option => [say(`blocks.${option}`), option]);
const dwells = (profile: Profile) => (): Option[] => [
  [say("blocks.dwellAuto"), "auto"],
  ...profile.dwell_ms.map((dwell): Option => [secondsMeaning(dwell), plainSeconds(dwell)]),
];
const taggedChoices = (): Option[] => [[say("blocks.taggedAuto"), "auto"], ...choices(["yes", "no"])];
const infraredChoices = () => choices(["same", "yes", "no"]);
const checkbox = (name: string, checked: boolean, ariaTypeName: string): Field => ({ type: "field_checkbox", name, checked, ariaTypeName });

/** The input of a step's field, as its declaration has it. */
function inputOf(field: StepField, profile: Profile): Field {
  switch (field.input) {
    case "seconds":
      return seconds(profile);
    case "choice":
      return menu(field.name, () => choices(field.options));
    case "number":
      return figure(field.name, field.first, field.minimum, MOST_TIMES);
    case "level":
      if (field.menu === "speed") return { type: SpeedField.KIND, name: field.name, options: speedsOf(profile), first: String(field.first) };
      return {
        ...menu(field.name, () => field.levels.map((level): Option => [levelText(profile, field.menu, level, isStart()), String(level)])),
        tooltip: field.levels.map((level) => levelText(profile, field.menu, level)).join(" · "),
      };
  }
}

/** The block of a kind of step. */
function definitionOf({ kind, category, accompanies, holds, fields }: StepKind): Definition {
  const inputs = (profile: Profile) => {
    const turn = kind === "drive" ? [{ type: TurnField.KIND, name: TurnField.NAME, rates: profile.turn_rates_deg_s }] : [];
    return [...fields.map((field) => inputOf(field, profile)), ...turn];
  };
  const takesTime = kind !== "repeat";
  return { message: kind, style: category, icon: kind, fields: inputs, takesTime, accompanies, ...(holds ? { holds: STEPS } : {}) };
}

const DEFINITIONS: Record<string, Definition> = {
  motorcade_leader: { message: "leader", style: "hat", icon: "leader", hat: true },
  motorcade_followers: {
    message: "followers",
    style: "hat",
    icon: "followers",
    hat: true,
    fields: (profile) => [
      checkbox("ACCEPT_IR", true, say("fields.accept_ir")),
      { ...checkbox("FORWARD", false, say("fields.forward")), tooltip: say("tooltips.passOn") },
      { ...menu("TAGGED", taggedChoices), tooltip: say("tooltips.tagged") },
      menu("DWELL", dwells(profile)),
    ],
  },
  ...Object.fromEntries(STEP_KINDS.map((each) => [`motorcade_${each.kind}`, definitionOf(each)])),
  ...DECIDING_BLOCKS,
  motorcade_infrared: {
    message: "infrared",
    style: "infrared",
    icon: "infrared",
    holds: STEPS,
    fields: () => [menu("ACCEPT_IR", infraredChoices), menu("FORWARD", infraredChoices)],
  },
};

/** A row of a block: a text with places, and what stands there. */
interface Row {
  message: string;
  fields: Field[];
}

const HIDDEN_PART = /\[(.*?)\]/;

/** The row of a block's icon and text. What stands in brackets has an input of its own, which is hidden without seconds. */
function textRow(text: string, icon: BlockIcon, fields: Field[]): Row {
  // The icon comes first, so every other field's number is one higher.
  const shifted = text.replace(/%(\d)/g, (_, number) => `%${Number(number) + 1}`);
  const before = `%${fields.length + 2}`;
  const message = shifted.replace(HIDDEN_PART, (_, inner: string, at: number) => {
    const isNewLine = shifted[at - 1] === "\n";
    return isNewLine ? `${inner} ${before}` : `${before}${inner} %${fields.length + 3}`;
  });
  const time = { type: "input_dummy", name: TIME };
  const isSplit = message !== shifted;
  const inputs = !isSplit ? [] : message.includes(`%${fields.length + 3}`) ? [{ type: "input_dummy" }, time] : [time];
  return { message: `%1 ${message}`, fields: [iconOf(icon), ...fields, ...inputs] };
}

const places = (fields: Field[]) => fields.map((_, number) => `%${number + 1}`).join(" ");

/** The definition as Blockly's JSON. */
function jsonOf(type: string, profile: Profile): Record<string, unknown> {
  const { message, style, icon, fields, takesTime, accompanies, holds, hat, isAlone, isCondition } = DEFINITIONS[type]!;
  const text = isStart() && !(type in DECIDING_BLOCKS) ? say(`startBlocks.${message as keyof Texts["startBlocks"]}`) : say(`blocks.${message}`);
  const own = fields?.(profile) ?? [];
  // The first level shows few settings of infrared: the block keeps the others, unseen.
  const isShown = ({ name }: Field) => !(isStart() && hat) || HAT_IN_START.some((each) => each === name);
  const hidden = own.filter((field) => !isShown(field));
  const unseen = [...hidden, { type: "input_dummy", name: HIDDEN }];
  const ends = takesTime ? endsInputs(type) : [];
  const rows: Row[] = [
    textRow(accompanies ? `${text}\n[${say("blocks.tail")}]` : text, icon, own.filter(isShown)),
    ...(hidden.length ? [{ message: places(unseen), fields: unseen }] : []),
    ...(ends.length ? [{ message: places(ends), fields: ends }] : []),
    ...(holds ?? []).flatMap(({ name, above }) => [
      ...(above ? [{ message: say(`blocks.${above}`), fields: [] }] : []),
      { message: "%1", fields: [{ type: "input_statement", name }] },
    ]),
  ];
  const numbered = rows.flatMap((row, index) => [
    [`message${index}`, row.message],
    [`args${index}`, row.fields],
  ]);
  const above = hat || isAlone ? {} : { previousStatement: null };
  const below = isAlone ? {} : { nextStatement: null };
  return {
    type,
    ...(Object.fromEntries(numbered) as Record<string, unknown>),
    style: `${style}_blocks`,
    tooltip: say(`tooltips.${message}`),
    ...(isCondition ? { output: isMinded(type) ? [CONDITION_CHECK, MINDED_CHECK] : CONDITION_CHECK } : { ...above, ...below }),
    inputsInline: true,
  };
}

/** Define the blocks for this profile and in the current language. */
export function defineBlocks(profile: Profile): void {
  for (const field of [SecondsField, SpeedField, TurnField, IconField, EndsField, NameField]) {
    Blockly.registry.register(Blockly.registry.Type.FIELD, field.KIND, field, true);
  }
  for (const [type, { takesTime, accompanies, hat }] of Object.entries(DEFINITIONS)) {
    Blockly.Blocks[type] = {
      init(this: Blockly.Block) {
        this.jsonInit(jsonOf(type, profile));
        if (hat) this.setDeletable(false);
        this.getInput(HIDDEN)?.setVisible(false);
        if (type === "motorcade_drive") {
          SpeedField.followDirection(this);
          SpeedField.showFigures(this, profile);
          TurnField.follow(this);
        }
        if (takesTime) followEnds(this, accompanies === true);
        if (this.getInput("OF1")) holdParts(this);
      },
    };
  }
}

/** The picture of a drive that minds the floor. */
const ON_DARK = "dark";
const drawer = (category: (typeof CATEGORIES)[number]) =>
  STEP_KINDS.filter((each) => each.category === category).map(({ kind }) => `motorcade_${kind}`);
const ACCOMPANYING: ReadonlySet<string> = new Set(STEP_KINDS.filter(({ accompanies }) => accompanies).map(({ kind }) => kind));
const START_BLOCKS: ReadonlySet<string> = new Set(STEP_KINDS.filter(({ in_start }) => in_start).map(({ kind }) => `motorcade_${kind}`));

const deciding = (drawer: string) =>
  Object.entries(DECIDING_BLOCKS).flatMap(([type, block]) => (block.drawer === drawer && type !== NEVER_OFFERED ? [type] : []));

const DRAWERS = {
  ...(Object.fromEntries(CATEGORIES.map((category) => [category, drawer(category)])) as Record<(typeof CATEGORIES)[number], string[]>),
  infrared: ["motorcade_infrared"],
  decide: deciding("decide"),
  count: deciding("count"),
  tell: deciding("tell"),
  mine: deciding("mine"),
};

/** A leader sends infrared and accepts none, so it has no block for it; a follower doesn't decide. */
const DRAWERS_OF: Record<EditorName, readonly (keyof typeof DRAWERS)[]> = {
  leader: [...CATEGORIES, "decide", "count", "tell", "mine"],
  followers: [...CATEGORIES, "infrared"],
};

/** Whether blocks of this type belong to the program without hanging below another. */
export const standsAlone = (type: string): boolean => DEFINITIONS[type]?.hat === true || DEFINITIONS[type]?.isAlone === true;

export const hatOf = (editor: EditorName) => `motorcade_${editor}`;

/** Whether blocks of this type can stand in the editor at all; a follower's drive minds what a leader's does. */
export function canStandIn(editor: EditorName, type: string): boolean {
  if (isMinded(type) || (type === NEVER_OFFERED && editor === "leader")) return true;
  return DRAWERS_OF[editor].some((drawer) => DRAWERS[drawer].includes(type));
}

/** Whether blocks may ask conditions, with these kinds of steps of a mission. */
export const offersConditions = (steps: readonly string[] | null) => (steps ? steps.includes("if") : !isStart());

/** The kinds of steps for what can be put on the stage. */
const ON_STAGE = {
  follow_line: ["line"],
  pir: ["person"],
  voice: ["voice"],
  avoid: ["wall", "disc", "polygon"],
  floor: ["patch", "spot"],
} as const satisfies Record<string, readonly (keyof Mat)[]>;

export function stepsFor(mat: Mat | null): string[] {
  const isThere = (things: readonly (keyof Mat)[]) => things.some((thing) => [mat?.[thing] ?? []].flat().length > 0);
  return Object.entries(ON_STAGE).flatMap(([kind, things]) => (isThere(things) ? [kind] : []));
}

/** What drives can mind, with these kinds of steps of a mission. */
export const mindedBy = (steps: readonly string[] | null) => MINDED_KINDS.filter((kind) => !steps || steps.includes(kind));

/** A block of the toolbox, with a picture above it of what a kind does. */
const offered = (kind: string, state: { type: string } = { type: kind }) => [...pictureAbove(kind), { kind: "block", ...state }];

/**
 * The drawers of an editor; with `steps`, those of a mission, only the blocks of these kinds are in them. The first level has
 * few, and those for what is `staged`.
 */
export function toolboxOf(editor: EditorName, steps: readonly string[] | null = null, staged: readonly string[] = []) {
  const allowed = (kind: string) => steps?.includes(kind) ?? (!isStart() || staged.includes(kind) || START_BLOCKS.has(`motorcade_${kind}`));
  const isShown = (type: string) => {
    if (type === "motorcade_infrared") return !isStart();
    const block = DECIDING_BLOCKS[type];
    if (block) return steps ? block.needs.every((kind) => steps.includes(kind)) : !isStart() || block.inStart === true;
    const kind = type.replace("motorcade_", "");
    // What a drive minds stands in its block; beside one it needs a together.
    if (ACCOMPANYING.has(kind) && (steps ? !steps.includes("together") : isStart())) return false;
    return allowed(kind);
  };
  const driving = STEP_KINDS.filter(({ kind, drives }) => drives && allowed(kind)).map(({ kind }) => `motorcade_${kind}`);
  const minding = MINDED_KINDS.filter((kind) => driving.length > 0 && allowed(kind));
  const contentsOf = (drawer: keyof typeof DRAWERS) => [
    ...(drawer === "sense" ? minding.flatMap((kind) => offered(kind === "floor" ? ON_DARK : kind, mindingBlock(driving[0]!, kind))) : []),
    ...DRAWERS[drawer].filter(isShown).flatMap((type) => offered(type)),
  ];
  return {
    kind: "categoryToolbox",
    contents: DRAWERS_OF[editor].filter((drawer) => contentsOf(drawer).length > 0).map((drawer) => ({
      kind: "category",
      name: say(`drawers.${drawer}`),
      categorystyle: `${drawer}_category`,
      cssconfig: { icon: "drawer-icon" },
      contents: contentsOf(drawer),
    })),
  };
}

/** Give Blockly its messages in the page's language. */
export const setBlocklyLanguage = () => Blockly.setLocale(textsOf("blockly"));
