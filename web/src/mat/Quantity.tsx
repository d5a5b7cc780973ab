import { Input, Label, NumberField } from "react-aria-components";

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
    <NumberField
      className="mat-field beside"
      value={value}
      step={step}
      minValue={least}
      maxValue={most}
      isDisabled={isDisabled}
      formatOptions={{ maximumFractionDigits: 3 }}
      onChange={(typed) => {
        // A field that is left rounds to its steps, which is nobody's wish to move a thing.
        if (Math.abs(typed - value) > step / 2) onChange(typed);
      }}
    >
      <Label>{label}</Label>
      <Input />
    </NumberField>
  );
}
