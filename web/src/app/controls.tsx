/** Buttons and dialogs as they look everywhere on the page. */

import type { ReactNode } from "react";
import {
  Button,
  CheckboxButton,
  CheckboxField,
  Dialog,
  Heading,
  Modal,
  ModalOverlay,
  Tooltip,
  TooltipTrigger,
  type ButtonProps,
} from "react-aria-components";
import { useTranslation } from "react-i18next";
import { Icon, type IconName } from "./icons";

interface IconButtonProps extends Omit<ButtonProps, "children"> {
  icon: IconName;
  /** Read out and shown on hover and focus. */
  label: string;
}

export function IconButton({ icon, label, ...props }: IconButtonProps) {
  return (
    <TooltipTrigger delay={500}>
      <Button {...props} className="icon-button" aria-label={label}>
        <Icon name={icon} />
      </Button>
      <Tooltip className="tooltip">{label}</Tooltip>
    </TooltipTrigger>
  );
}

interface CheckProps {
  id?: string;
  checked: boolean;
  onChange: (checked: boolean) => void;
  children: ReactNode;
}

export function Check({ id, checked, onChange, children }: CheckProps) {
  return (
    <CheckboxField id={id} isSelected={checked} onChange={onChange}>
      <CheckboxButton className="checkbox">
        <span className="checkbox-box">
          <Icon name="done" />
        </span>
        {children}
      </CheckboxButton>
    </CheckboxField>
  );
}

interface SheetProps {
  title: string;
  onClose: () => void;
  children: ReactNode;
  wide?: boolean;
  role?: "dialog" | "alertdialog";
}

/** A dialog above the page; Escape and a click beside it close it. */
export function Sheet({ title, onClose, children, wide = false, role = "dialog" }: SheetProps) {
  const { t } = useTranslation();
  return (
    <ModalOverlay className="overlay" isOpen isDismissable={role === "dialog"} onOpenChange={(open) => open || onClose()}>
      <Modal className={wide ? "sheet wide" : "sheet"}>
        <Dialog role={role} className="sheet-body">
          <header className="sheet-head">
            <Heading slot="title">{title}</Heading>
            <IconButton icon="close" label={t("app.close")} onPress={onClose} />
          </header>
          {children}
        </Dialog>
      </Modal>
    </ModalOverlay>
  );
}
