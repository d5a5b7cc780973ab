/** A field for the level of a speed: beside a turn it means an angle a second, else a length. */

import * as Blockly from "blockly/core";
import i18next from "i18next";
import type { Profile } from "../api/types";
import { speedMeaning, turnMeaning } from "./figures";

const LEVELS = [0, 1, 2, 3];
type Option = [string, string];
type Options = (this: Blockly.FieldDropdown) => Option[];

export function speedsOf(profile: Profile): Options {
  return function (this: Blockly.FieldDropdown) {
    const direction: unknown = this.getSourceBlock()?.getFieldValue("DIRECTION");
    const meaning = direction === "left" || direction === "right" ? turnMeaning : speedMeaning;
    return LEVELS.map((level) => [i18next.t("blocks.speed", { level, meaning: meaning(profile, level) }), String(level)]);
  };
}

/** Blockly keeps the chosen option's text; here the text changes with the field beside it. */
export class SpeedField extends Blockly.FieldDropdown {
  static readonly KIND = "field_motorcade_speed";

  static override fromJson(config: Blockly.FieldDropdownFromJsonConfig & { first?: string }): SpeedField {
    const field = new this(config.options!, undefined, config);
    // A dropdown begins with its first option, which here would stand still.
    if (config.first) field.setValue(config.first);
    return field;
  }

  static announce(): void {
    if (!Blockly.registry.hasItem(Blockly.registry.Type.FIELD, SpeedField.KIND)) {
      Blockly.fieldRegistry.register(SpeedField.KIND, SpeedField);
    }
  }

  static followDirection(block: Blockly.Block): void {
    block.getField("DIRECTION")?.setValidator((direction: string) => {
      block.getField("SPEED")?.forceRerender();
      return direction;
    });
  }

  protected override getText_(): string | null {
    const option = this.getOptions(false).find((each) => each[1] === this.getValue());
    return typeof option?.[0] === "string" ? option[0] : super.getText_();
  }

  override getAriaValue(): string {
    return this.getText();
  }
}
