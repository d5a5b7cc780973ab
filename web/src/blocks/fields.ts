/** The fields of blocks that Blockly lacks: seconds that the cars can do, speeds beside a direction, and the icon before a text. */

import * as Blockly from "blockly/core";
import type { Profile } from "../api/types";
import { STEP_KINDS } from "../generated/steps";
import { say } from "../i18n";
import { isStart } from "../state/settings";
import { levelMeaning, levelText } from "./figures";

interface SecondsConfig extends Blockly.FieldConfig {
  value?: number;
  least?: number;
  step?: number;
  most?: number;
}

/**
 * The arrow keys and the spinner offer only durations that the cars can do. Another value that is typed, or is in a file,
 * is not changed: the compiler refuses it and names the nearest possible ones.
 */
export class SecondsField extends Blockly.FieldNumber {
  static readonly KIND = "field_motorcade_seconds";
  private readonly step: number;
  private readonly least: number;

  constructor({ value = 1, least = 0, step = 1, most = Infinity, ...config }: SecondsConfig) {
    super(value, 0, most, 0.001, null, config);
    this.step = step;
    this.least = least;
  }

  static override fromJson(options: SecondsConfig): SecondsField {
    return new this(options);
  }

  protected override widgetCreate_(): HTMLInputElement {
    const input = super.widgetCreate_();
    input.inputMode = "decimal";
    input.addEventListener("keydown", (event) => this.stepOnArrow(event, input));
    return input;
  }

  /**
   * Read what was typed: full-width digits as the others, a comma as the decimal point. Blockly would leave the comma out,
   * and take nothing for 0.
   */
  protected override doClassValidation_(typed?: unknown): number | null {
    if (typeof typed !== "string") return super.doClassValidation_(typed);
    const text = typed.normalize("NFKC").replace(/[,。]/, ".").trim();
    return text === "" ? null : super.doClassValidation_(text);
  }

  private stepOnArrow(event: KeyboardEvent, input: HTMLInputElement): void {
    const way = event.key === "ArrowUp" ? 1 : event.key === "ArrowDown" ? -1 : 0;
    if (way === 0) return;
    event.preventDefault();
    const next = Math.max(this.least, Math.round((Number(input.value) || 0) / this.step + way) * this.step);
    input.value = String(Math.min(next, this.getMax()));
    input.dispatchEvent(new Event("input", { bubbles: true }));
  }
}

const LEVELS = [0, 1, 2, 3];
type Option = [string, string];
type Options = (this: Blockly.FieldDropdown) => Option[];

/** What a level of speed means beside the direction of a block. */
function meaningBeside(block: Blockly.Block | null, profile: Profile, level: number): string {
  const direction: unknown = block?.getFieldValue("DIRECTION");
  return levelMeaning(profile, "speed", level, direction === "left" || direction === "right");
}

export function speedsOf(profile: Profile): Options {
  return function (this: Blockly.FieldDropdown) {
    const inWords = isStart();
    return LEVELS.map((level) => {
      const text = say("blocks.speed", { level, meaning: meaningBeside(this.getSourceBlock(), profile, level) });
      return [inWords ? levelText(profile, "speed", level, true) : text, String(level)];
    });
  };
}

/** Blockly keeps the chosen option's text; here the text changes with the field beside it. */
export class SpeedField extends Blockly.FieldDropdown {
  static readonly KIND = "field_motorcade_speed";

  static override fromJson(config: Blockly.FieldDropdownFromJsonConfig & { first?: string }): SpeedField {
    const field = new this(config.options!, undefined, config);
    // A dropdown begins with its first option, which here would be speed 0.
    if (config.first) field.setValue(config.first);
    return field;
  }

  static followDirection(block: Blockly.Block): void {
    block.getField("DIRECTION")?.setValidator((direction: string) => {
      block.getField("SPEED")?.forceRerender();
      block.getField(TurnField.NAME)?.forceRerender();
      return direction;
    });
  }

  /** What the chosen level is in figures. */
  static showFigures(block: Blockly.Block, profile: Profile): void {
    block.getField("SPEED")?.setTooltip(() => meaningBeside(block, profile, Number(block.getFieldValue("SPEED"))));
  }

  protected override getText_(): string | null {
    const option = this.getOptions(false).find((each) => each[1] === this.getValue());
    return typeof option?.[0] === "string" ? option[0] : super.getText_();
  }

  override getAriaValue(): string {
    return this.getText();
  }
}

/** How far a turn goes, in words for parts of a whole one. */
const TURNS = { 90: "quarter", 180: "half", 270: "threeQuarters", 360: "whole" } as const;

/** What a turn of the block comes to; nothing for a block that drives on, or turns until something happens. */
export class TurnField extends Blockly.FieldLabel {
  static readonly KIND = "field_motorcade_turn";
  static readonly NAME = "TURN";
  private readonly rates: readonly number[];

  constructor({ rates = [], ...config }: Blockly.FieldLabelConfig & { rates?: readonly number[] }) {
    super("", undefined, config);
    this.rates = rates;
  }

  static override fromJson(options: Blockly.FieldLabelFromJsonConfig & { rates?: readonly number[] }): TurnField {
    return new this(options);
  }

  /** Let the field tell of a new speed or time at once. */
  static follow(block: Blockly.Block): void {
    for (const name of ["SPEED", "SECONDS"]) {
      block.getField(name)!.setValidator((value: unknown) => {
        block.getField(TurnField.NAME)!.forceRerender();
        return value;
      });
    }
  }

  /** Blockly measures an empty text each time. */
  protected override getDisplayText_(): string {
    return super.getDisplayText_() || Blockly.Field.NBSP;
  }

  protected override getText_(): string {
    const block = this.getSourceBlock();
    const isTurn = ["left", "right"].includes(String(block?.getFieldValue("DIRECTION")));
    if (!block || !isTurn || block.getFieldValue("ENDS") === "until") return "";
    const angle = this.rates[Number(block.getFieldValue("SPEED"))]! * Number(block.getFieldValue("SECONDS"));
    return angle in TURNS ? say(`blocks.turns.${TURNS[angle as keyof typeof TURNS]}`) : say("blocks.turns.angle", { angle });
  }
}

/** Of blocks that are no steps. */
const OWN_ICONS = {
  leader: "m12 3 2.6 5.6 6.1.7-4.5 4.200 1.200 6L12 16.500 6.600 19.500l1.200-6L3.300 9.300l6.100-.7z",
  followers: "M7 4l4 7H3zM17 4l4 7h-8zM12 13l4 7H8z",
  if: "M12 3v5M12 8l-6 6v7M12 8l6 6v7M3 18l3 3 3-3M15 18l3 3 3-3",
  count: "M5 4v16M10 4v16M15 4v16M20 4v16M3 17 22 7",
  dice: "M5 5h14v14H5zM9 9v.1M15 9v.1M9 15v.1M15 15v.1M12 12v.1",
  not: "M5 12a7 7 0 1 0 14 0 7 7 0 1 0-14 0M7 7l10 10",
  and: "M5 12a5 5 0 1 0 10 0 5 5 0 1 0-10 0M9 12a5 5 0 1 0 10 0 5 5 0 1 0-10 0",
  or: "M4 6l7 6-7 6M20 6l-7 6 7 6",
  tell: "M4 10v4h4l7 5V5l-7 5zM18 9a4 4 0 0 1 0 6",
  mine: "M4 8h5a2.500 2.500 0 1 1 5 0h6v5a2.500 2.500 0 1 0 0 5v2H4z",
  jump: "M4 18C4 6 18 6 18 14M13 10l5 5 4-6",
  infrared: "M12 18v.1M8.500 14.500a5 5 0 0 1 7 0M5.500 11.500a9 9 0 0 1 13 0M3 8a13 13 0 0 1 18 0",
} as const;

export type BlockIcon = keyof typeof OWN_ICONS | (typeof STEP_KINDS)[number]["kind"];

const ICONS = { ...OWN_ICONS, ...Object.fromEntries(STEP_KINDS.map(({ kind, icon }) => [kind, icon])) } as Record<BlockIcon, string>;

/** A picture that says no more than the text behind it: screen readers pass over it. */
export class IconField extends Blockly.FieldImage {
  static readonly KIND = "field_motorcade_icon";

  static override fromJson(config: Blockly.FieldImageFromJsonConfig): IconField {
    return new this(config.src!, config.width!, config.height!, "");
  }

  override computeAriaLabel(): string {
    return "";
  }
}

/** The icon as a field of Blockly, in the colour of the text behind it. */
export function iconOf(name: BlockIcon) {
  const pen = 'fill="none" stroke="#fff" stroke-width="2" stroke-linecap="round" stroke-linejoin="round"';
  const path = `<path d="${ICONS[name]}"/>`;
  const svg = `<svg xmlns="http://www.w3.org/2000/svg" width="24" height="24" viewBox="0 0 24 24" ${pen}>${path}</svg>`;
  return { type: IconField.KIND, src: `data:image/svg+xml,${encodeURIComponent(svg)}`, width: 24, height: 24 };
}
