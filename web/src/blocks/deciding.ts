/** The blocks of a leader that decides: branches, loops, conditions, counters, what it tells its followers, own blocks. */

import type * as Blockly from "blockly/core";
import { say, type Texts } from "../i18n";
import type { Profile } from "../api/types";
import { FLOW_CONDITIONS, FLOW_OPS, SENSES } from "../generated/steps";
import { isStart } from "../state/settings";
import { CONDITION_CHECK } from "./endings";
import { levelMeaning } from "./figures";
import type { BlockIcon } from "./fields";
import { COMPARISONS } from "../words/deciding";
import { counterField, ownBlockField } from "./names";

export type Option = [string, string];
export type Field = Record<string, unknown>;
type Drawer = "decide" | "count" | "tell" | "mine";
/** The keys of blocks' texts. */
export type Message = { [Key in keyof Texts["blocks"]]: Texts["blocks"][Key] extends string ? Key : never }[keyof Texts["blocks"]];

/** A type of block. */
export interface Definition {
  /** The key of the block's text, and of its tooltip. */
  message: Message & keyof Texts["tooltips"];
  style: string;
  icon: BlockIcon;
  /** Fields, and gaps for conditions, which stand in its text. */
  fields?: (profile: Profile) => Field[];
  /** The step takes time: what ends it can be chosen. */
  takesTime?: boolean;
  /** The step lasts as long as those beside it in a together. */
  accompanies?: boolean;
  /** Its rows of blocks, each with the text above it. */
  holds?: { name: string; above?: "else" }[];
  hat?: boolean;
  /** It stands alone, as a hat does. */
  isAlone?: boolean;
  isCondition?: boolean;
}

interface DecidingBlock extends Definition {
  drawer: Drawer;
  /** Whether the first level has it. */
  inStart?: boolean;
  /** The kinds of steps that a mission must allow for it. */
  needs: string[];
}

/** What a counter can hold. */
const MOST_COUNT = 255;

const gap = (name: string): Field => ({ type: "input_value", name, check: CONDITION_CHECK });
export const menu = (name: string, options: Option[] | (() => Option[])): Field => ({ type: "field_dropdown", name, options });
export const figure = (name: string, value: number, min: number, max: number): Field => ({ type: "field_number", name, value, min, max, precision: 1 });
const count = (name: string, value: number) => figure(name, value, 0, MOST_COUNT);

const radii = (profile: Profile): Option[] => {
  const text = (level: number) => {
    const meaning = levelMeaning(profile, "radius", level);
    return isStart() ? meaning : say("blocks.speed", { level, meaning });
  };
  return SENSES.obstacle.map((level) => [text(level), String(level)]);
};

/** The one row of blocks of most that have any. */
export const STEPS = [{ name: "STEPS" }];
const REPEATS = ["repeat", "if"];

const BLOCKS = {
  wait_until: { drawer: "decide", icon: "wait", fields: () => [gap("UNTIL")], inStart: true, needs: ["wait", "if"] },
  if: { drawer: "decide", icon: "if", fields: () => [gap("WHEN")], holds: [{ name: "THEN" }], inStart: true, needs: ["if"] },
  if_else: {
    drawer: "decide",
    icon: "if",
    fields: () => [gap("WHEN")],
    holds: [{ name: "THEN" }, { name: "ELSE", above: "else" }],
    inStart: true,
    needs: ["if"],
  },
  repeat_until: { drawer: "decide", icon: "repeat", fields: () => [gap("UNTIL")], holds: STEPS, needs: REPEATS },
  forever: { drawer: "decide", icon: "repeat", holds: STEPS, needs: REPEATS },
  when_obstacle: { drawer: "decide", style: "sense", icon: "avoid", fields: (profile) => [menu("LEVEL", () => radii(profile))], inStart: true },
  when_person: { drawer: "decide", style: "sense", icon: "pir", inStart: true },
  when_voice: { drawer: "decide", style: "sense", icon: "voice", fields: () => [menu("COMMAND", () => wordsOf(SENSES.voice))], inStart: true },
  when_floor: { drawer: "decide", style: "sense", icon: "floor", fields: () => [menu("WHERE", () => wordsOf(SENSES.floor))], inStart: true },
  when_chance: { drawer: "decide", icon: "dice", fields: () => [{ ...figure("PERCENT", 50, 1, 99), precision: 0 }] },
  when_not: { drawer: "decide", icon: "not", fields: () => [gap("OF")] },
  when_all: { drawer: "decide", icon: "and", fields: () => [gap("OF0"), gap("OF1")] },
  when_any: { drawer: "decide", icon: "or", fields: () => [gap("OF0"), gap("OF1")] },
  set: { drawer: "count", icon: "count", fields: () => [counterField(), count("TO", 0)], needs: ["set"] },
  change: {
    drawer: "count",
    icon: "count",
    fields: () => [counterField(), figure("BY", 1, -MOST_COUNT, MOST_COUNT)],
    needs: ["change"],
  },
  set_random: { drawer: "count", icon: "dice", fields: () => [counterField(), count("RANDOM", 6)], needs: ["set"] },
  when_counter: {
    drawer: "count",
    icon: "count",
    fields: () => [counterField(), menu("IS", () => wordsOf(COMPARISONS)), count("VALUE", 3)],
    needs: ["if", "change"],
  },
  tell: { drawer: "tell", icon: "tell", holds: STEPS, needs: ["tell"] },
  in_turn: { drawer: "tell", icon: "followers", needs: ["tell"] },
  define: { drawer: "mine", icon: "mine", fields: () => [ownBlockField()], holds: STEPS, isAlone: true, needs: ["do"] },
  do: { drawer: "mine", icon: "mine", fields: () => [ownBlockField()], needs: ["do"] },
  flow: {
    drawer: "decide",
    icon: "jump",
    fields: () => [
      menu("OP", () => FLOW_OPS.map((op) => [say(`flow.${op}`), op])),
      count("TARGET", 0),
      menu("CONDITION", () => FLOW_CONDITIONS.map((condition) => [say(`flow.${condition}`), condition])),
      figure("IF_NOT", 0, 0, 1),
      figure("LEVEL", 0, 0, 3),
      figure("COUNTER", 0, 0, 3),
      count("VALUE", 0),
    ],
    needs: ["flow"],
  },
} satisfies Record<string, Partial<DecidingBlock> & { drawer: Drawer; icon: BlockIcon }>;

function wordsOf(names: readonly (keyof Texts["blocks"]["asked"])[]): Option[] {
  return names.map((name) => [say(`blocks.asked.${name}`), name]);
}

/** By the type of block. */
export const DECIDING_BLOCKS: Readonly<Record<string, DecidingBlock>> = Object.fromEntries(
  Object.entries(BLOCKS).map(([name, block]: [string, Partial<DecidingBlock> & { drawer: Drawer; icon: BlockIcon }]) => {
    const message = name as DecidingBlock["message"];
    return [`motorcade_${name}`, { message, style: block.drawer, isCondition: name.startsWith("when_"), needs: ["if"], ...block }];
  }),
);

/** Not offered: only an image that nobody compiled has it. */
export const NEVER_OFFERED = "motorcade_flow";

/** 'and' and 'or' of more than two conditions, or of one, keep how many. */
const PARTS = 2;

export function holdParts(block: Blockly.Block): void {
  let parts = PARTS;
  block.saveExtraState = () => (parts === PARTS ? null : { parts });
  block.loadExtraState = (state: { parts?: number }) => {
    for (; parts > (state.parts ?? PARTS); parts--) block.removeInput(`OF${parts - 1}`);
    for (; parts < (state.parts ?? PARTS); parts++) {
      const input = block.appendValueInput(`OF${parts}`).setCheck(CONDITION_CHECK);
      input.appendField(say(block.type === "motorcade_when_all" ? "blocks.and" : "blocks.or"));
    }
  };
}
