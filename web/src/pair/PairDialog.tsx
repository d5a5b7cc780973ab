/** Share the open project between this tab and another one. */

import { useState } from "react";
import { useTranslation } from "react-i18next";
import { closeDialog } from "../state/dialogs";
import controls from "../ui/controls.module.css";
import { Sheet, TextButton } from "../ui/controls";
import { canShare, openSecondWindow } from "./tabs";

export function PairDialog() {
  const { t } = useTranslation();
  const [problem, setProblem] = useState<"pair.noLocks" | "pair.noStorage" | null>(canShare() ? null : "pair.noLocks");
  const open = () => void openSecondWindow().then((done) => (done ? closeDialog() : setProblem("pair.noStorage")));
  return (
    <Sheet title={t("pair.title")}>
      <p>{t("pair.about")}</p>
      <p role={problem ? "alert" : undefined}>{t(problem ?? "pair.aboutTabs")}</p>
      <footer className={controls.sheetFoot}>
        <TextButton primary isDisabled={problem !== null} onPress={open}>{t("pair.openTab")}</TextButton>
      </footer>
    </Sheet>
  );
}
