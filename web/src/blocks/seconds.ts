/** A field for seconds that steps through what the cars' durations add up to. */

import * as Blockly from "blockly/core";

interface SecondsConfig extends Blockly.FieldConfig {
  value?: number;
  least?: number;
  step?: number;
  most?: number;
}

/**
 * The arrow keys and the spinner offer only what can be had. Another value that is typed, or stands in a file,
 * stays as it is: the server names the nearest that the cars can, which is better than changing it in silence.
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

  static announce(): void {
    if (!Blockly.registry.hasItem(Blockly.registry.Type.FIELD, SecondsField.KIND)) {
      Blockly.fieldRegistry.register(SecondsField.KIND, SecondsField);
    }
  }

  protected override widgetCreate_(): HTMLInputElement {
    const input = super.widgetCreate_();
    input.inputMode = "decimal";
    input.addEventListener("keydown", (event) => this.stepOnArrow(event, input));
    return input;
  }

  private stepOnArrow(event: KeyboardEvent, input: HTMLInputElement): void {
    const way = event.key === "ArrowUp" ? 1 : event.key === "ArrowDown" ? -1 : 0;
    if (way === 0) return;
    event.preventDefault();
    const next = Math.max(this.least, Math.round((Number(input.value) || 0) / this.step + way) * this.step);
    input.value = String(Math.min(next, this.getMax()));
    input.dispatchEvent(new Event("input"));
  }
}
