/** Buttons and dialogs as they look everywhere on the page. */

import { type ReactNode, useEffect, useState } from "react";
import {
  Button,
  CheckboxButton,
  CheckboxField,
  Dialog,
  Heading,
  Menu,
  MenuItem,
  type MenuItemProps,
  type MenuProps,
  MenuTrigger,
  Modal,
  ModalOverlay,
  Popover,
  type PopoverProps,
  Tooltip,
  TooltipTrigger,
  type ButtonProps,
} from "react-aria-components";
import { flushSync } from "react-dom";
import { useTexts } from "../i18n";
import { closeDialog } from "../state/dialogs";
import { listen } from "./areas";
import { classes } from "./classes";
import { Icon, type IconName } from "./icons";
import buttons from "./buttons.module.css";
import controls from "./controls.module.css";

interface IconButtonProps extends Omit<ButtonProps, "children"> {
  icon: IconName;
  /** Read out and shown on hover and focus. */
  label: string;
}

/** A button with a hint, shown on hover and focus. */
export function Hinted({ hint, children }: { hint: string; children: ReactNode }) {
  const [isOpen, setOpen] = useState(false);
  useEffect(() => {
    if (!isOpen) return;
    // While a hint is open React Aria keeps Escape for it; so it goes first, and the key still closes the dialog around it.
    return listen(window, ["keydown"], ({ key }: KeyboardEvent) => key === "Escape" && flushSync(() => setOpen(false)), true);
  }, [isOpen]);
  return (
    <TooltipTrigger delay={500} isOpen={isOpen} onOpenChange={setOpen}>
      {children}
      <Tooltip className={controls.tooltip}>{hint}</Tooltip>
    </TooltipTrigger>
  );
}

interface TextButtonProps extends ButtonProps {
  small?: boolean;
  /** What is usually wanted here. */
  primary?: boolean;
  /** Without a border. */
  quiet?: boolean;
  /** Like a link in a text. */
  link?: boolean;
}

/** A button with words. */
export function TextButton({ small = false, primary = false, quiet = false, link = false, ...props }: TextButtonProps) {
  const names = classes(buttons.button, small && buttons.small, primary && buttons.primary, quiet && buttons.quietButton);
  return <Button {...props} className={link ? buttons.link : names} />;
}

export function IconButton({ icon, label, ...props }: IconButtonProps) {
  return (
    <Hinted hint={label}>
      <Button {...props} className={buttons.iconButton} aria-label={label}>
        <Icon name={icon} />
      </Button>
    </Hinted>
  );
}

interface MenuButtonProps extends MenuProps<object> {
  /** What opens the menu. */
  button: ReactNode;
  placement?: PopoverProps["placement"];
}

/** A button that opens a menu. */
export function MenuButton({ button, placement, ...menu }: MenuButtonProps) {
  return (
    <MenuTrigger>
      {button}
      <Popover className={controls.popover} placement={placement}>
        <Menu {...menu} />
      </Popover>
    </MenuTrigger>
  );
}

export function Entry(props: MenuItemProps) {
  return <MenuItem {...props} className={controls.menuItem} />;
}

export function Check({ checked, onChange, children }: { checked: boolean; onChange: (checked: boolean) => void; children: ReactNode }) {
  return (
    <CheckboxField isSelected={checked} onChange={onChange}>
      <CheckboxButton className={controls.checkbox}>
        <span className={controls.checkboxBox}>
          <Icon name="done" />
        </span>
        {children}
      </CheckboxButton>
    </CheckboxField>
  );
}

interface SheetProps {
  title: string;
  /** For a sheet that is none of the page's dialogs. */
  onClose?: () => void;
  children: ReactNode;
  wide?: boolean;
  role?: "dialog" | "alertdialog";
}

/** A dialog above the page; Escape and a click beside it close it. */
export function Sheet({ title, onClose = closeDialog, children, wide = false, role = "dialog" }: SheetProps) {
  const t = useTexts();
  return (
    <ModalOverlay className={controls.overlay} isOpen isDismissable={role === "dialog"} onOpenChange={(open) => open || onClose()}>
      <Modal className={classes(controls.sheet, wide && controls.wide)}>
        <Dialog role={role} className={controls.sheetBody}>
          <header className={controls.sheetHead}>
            <Heading slot="title">{title}</Heading>
            <IconButton icon="close" label={t("app.close")} onPress={onClose} />
          </header>
          {children}
        </Dialog>
      </Modal>
    </ModalOverlay>
  );
}
