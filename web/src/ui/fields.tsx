/** Buttons with pictures, switches, lists, sliders and number fields. */

import type { ReactNode } from "react";
import {
  Button,
  type ButtonProps,
  Input,
  Label,
  ListBox,
  ListBoxItem,
  NumberField,
  type NumberFieldProps,
  Popover,
  Select,
  SelectValue,
  Slider,
  type SliderProps,
  SliderThumb,
  SliderTrack,
  ToggleButton,
} from "react-aria-components";
import { Hinted } from "./controls";
import { Icon, type IconName } from "./icons";
import buttons from "./buttons.module.css";
import controls from "./controls.module.css";
import fields from "./fields.module.css";
import { classes } from "./classes";

interface ToolButtonProps extends Omit<ButtonProps, "children" | "className"> {
  icon: IconName;
  label: string;
  /** Words beside the picture: the label itself, or shorter ones. */
  wide?: boolean | string;
  primary?: boolean;
}

export function ToolButton({ icon, label, wide = false, primary, ...props }: ToolButtonProps) {
  const button = (
    <Button {...props} className={classes(buttons.button, buttons.tool, primary && buttons.primary)} aria-label={wide === true ? undefined : label}>
      <Icon name={icon} />
      {wide !== false && <span>{wide === true ? label : wide}</span>}
    </Button>
  );
  if (wide === true) return button;
  return <Hinted hint={label}>{button}</Hinted>;
}

interface ToolSwitchProps {
  label: string;
  isSelected: boolean;
  onChange: (isSelected: boolean) => void;
}

export function ToolSwitch({ label, isSelected, onChange }: ToolSwitchProps) {
  return (
    <ToggleButton className={fields.toggle} isSelected={isSelected} onChange={onChange}>
      <span className={fields.tick} aria-hidden="true" />
      {label}
    </ToggleButton>
  );
}

interface ChoiceProps<T extends string> {
  label: string;
  value: T;
  all: readonly T[];
  name: (each: T) => string;
  onChange: (chosen: T) => void;
}

/** A list of which one entry is chosen. */
export function Choice<T extends string>({ label, value, all, name, onChange }: ChoiceProps<T>) {
  return (
    <Select className={fields.select} value={value} onChange={(key) => onChange(key as T)}>
      <Label className="unseen">{label}</Label>
      <Button className={classes(buttons.button, buttons.tool)}>
        <SelectValue />
        <Icon name="right" />
      </Button>
      <Popover className={controls.popover}>
        <ListBox>
          {all.map((each) => (
            <ListBoxItem key={each} id={each} className={controls.menuItem}>
              {name(each)}
            </ListBoxItem>
          ))}
        </ListBox>
      </Popover>
    </Select>
  );
}

interface NumberBoxProps extends Omit<NumberFieldProps, "children" | "className"> {
  label: string;
  /** Whether the label stands beside the field. */
  beside?: boolean;
  onChange: (value: number) => void;
}

/** A field for a number; to empty it changes nothing. */
export function NumberBox({ label, beside = true, onChange, ...props }: NumberBoxProps) {
  return (
    <NumberField {...props} className={classes(fields.field, beside && fields.beside)} onChange={(typed) => Number.isNaN(typed) || onChange(typed)}>
      <Label>{label}</Label>
      <Input />
    </NumberField>
  );
}

interface BarProps extends Omit<SliderProps<number>, "children" | "className"> {
  label: string;
  /** What the thumb is called, where that is more than the label. */
  thumbLabel?: string;
  /** What stands on the bar, below the thumb. */
  children?: ReactNode;
}

/** A bar with a thumb. */
export function Bar({ label, thumbLabel, children, ...props }: BarProps) {
  return (
    <Slider {...props} className={fields.slider} aria-label={label}>
      <SliderTrack className={fields.track}>
        {children}
        <SliderThumb className={fields.thumb} aria-label={thumbLabel} />
      </SliderTrack>
    </Slider>
  );
}

interface NumberSliderProps {
  label: string;
  value: number;
  most: number;
  least?: number;
  step?: number;
  /** Where the slider stands for a value, where that isn't the value itself; in whole steps up to `positions`. */
  scale?: { positions: number; positionOf: (value: number) => number; valueAt: (position: number) => number };
  format?: Intl.NumberFormatOptions;
  onChange: (value: number) => void;
  onEnd?: () => void;
}

/** A slider, and beside it a field for an exact number. */
export function NumberSlider(props: NumberSliderProps) {
  const { label, value, most, least = 0, step = 1, scale, format, onChange, onEnd } = props;
  const valueAt = scale?.valueAt ?? ((position: number) => position);
  return (
    <div className={fields.number}>
      <Bar
        label={label}
        value={scale ? scale.positionOf(value) : value}
        minValue={scale ? 0 : least}
        maxValue={scale?.positions ?? most}
        step={scale ? 1 : step}
        onChange={(position) => onChange(valueAt(position))}
        onChangeEnd={() => onEnd?.()}
      />
      <NumberBox
        label={label}
        beside={false}
        value={value}
        minValue={least}
        maxValue={most}
        // Half a car is no car. Smaller steps are for the slider alone.
        {...(step >= 1 && { step: 1 })}
        {...(format && { formatOptions: format })}
        onChange={(typed) => {
          onChange(typed);
          onEnd?.();
        }}
      />
    </div>
  );
}

interface QuantityProps {
  label: string;
  value: number;
  least?: number;
  most?: number;
  step?: number;
  isDisabled?: boolean;
  onChange: (value: number) => void;
}

/** A number of metres or seconds; its label says which. */
export function Quantity({ label, value, least = -2000, most = 100_000, step = 0.01, isDisabled = false, onChange }: QuantityProps) {
  return (
    <NumberBox
      label={label}
      value={value}
      step={step}
      minValue={least}
      maxValue={most}
      isDisabled={isDisabled}
      formatOptions={{ maximumFractionDigits: 3 }}
      onChange={(typed) => {
        // A field rounds its value when it loses the focus; that is no edit.
        if (Math.abs(typed - value) > step / 2) onChange(typed);
      }}
    />
  );
}
