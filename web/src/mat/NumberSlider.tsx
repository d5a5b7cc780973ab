import { Input, Label, NumberField, Slider, SliderThumb, SliderTrack } from "react-aria-components";

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

/** A slider for the hand, and a field beside it for a certain number. */
export function NumberSlider(props: NumberSliderProps) {
  const { label, value, most, least = 0, step = 1, scale, format, onChange, onEnd } = props;
  const valueAt = scale?.valueAt ?? ((position: number) => position);
  return (
    <div className="mat-number">
      <Slider
        className="mat-slider"
        aria-label={label}
        value={scale ? scale.positionOf(value) : value}
        minValue={scale ? 0 : least}
        maxValue={scale?.positions ?? most}
        step={scale ? 1 : step}
        onChange={(position) => onChange(valueAt(position))}
        onChangeEnd={() => onEnd?.()}
      >
        <SliderTrack className="mat-track">
          <SliderThumb className="mat-thumb" />
        </SliderTrack>
      </Slider>
      <NumberField
        className="mat-field"
        value={value}
        minValue={least}
        maxValue={most}
        {...(format && { formatOptions: format })}
        onChange={(typed) => {
          if (!Number.isNaN(typed)) onChange(typed);
          onEnd?.();
        }}
      >
        <Label>{label}</Label>
        <Input />
      </NumberField>
    </div>
  );
}
