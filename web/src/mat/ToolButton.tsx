import { Button, type ButtonProps, ToggleButton, Tooltip, TooltipTrigger } from "react-aria-components";
import { MatIcon, type MatIconName } from "./icons";

interface ToolButtonProps extends Omit<ButtonProps, "children" | "className"> {
  icon: MatIconName;
  label: string;
  /** Words beside the picture: the label itself, or shorter ones. */
  wide?: boolean | string;
  tone?: "main" | "plain";
}

export function ToolButton({ icon, label, wide = false, tone = "plain", ...props }: ToolButtonProps) {
  const button = (
    <Button {...props} className={`mat-button ${tone}${wide === false ? "" : " wide"}`} aria-label={wide === true ? undefined : label}>
      <MatIcon name={icon} />
      {wide !== false && <span>{wide === true ? label : wide}</span>}
    </Button>
  );
  if (wide === true) return button;
  return (
    <TooltipTrigger delay={500}>
      {button}
      <Tooltip className="tooltip">{label}</Tooltip>
    </TooltipTrigger>
  );
}

interface ToolSwitchProps {
  label: string;
  isSelected: boolean;
  onChange: (isSelected: boolean) => void;
}

export function ToolSwitch({ label, isSelected, onChange }: ToolSwitchProps) {
  return (
    <ToggleButton className="mat-toggle" isSelected={isSelected} onChange={onChange}>
      <span className="mat-tick" aria-hidden="true" />
      {label}
    </ToggleButton>
  );
}
