import { Button } from "react-aria-components";
import { useTranslation } from "react-i18next";
import { Icon } from "../app/icons";
import { inLanguage } from "../i18n";
import type { Outcome } from "./transfer";

interface ResultProps {
  outcome: Outcome | "cut-off";
  onOpen: (image: string) => void;
}

/** What became of a transfer: never more than what is known. */
export function Result({ outcome, onOpen }: ResultProps) {
  const { t } = useTranslation();
  if (outcome === "cut-off") {
    return <Told tone="error" title={t("upload.failed")} text={t("upload.cutOff")} />;
  }
  switch (outcome.outcome) {
    case "verified":
      return <Told tone="success" title={t("upload.verified")} text={outcome.answer} />;
    case "not-verified":
      return <Told tone="warning" title={t("upload.notVerified")} text={t("upload.notVerifiedAbout")} />;
    case "failed":
      return <Told tone="error" title={t("upload.failed")} text={inLanguage(outcome.error.sentence)} />;
    case "image":
      return (
        <div className="result success" role="status">
          <Icon name="done" />
          <div>
            <b>{t("upload.read", { words: Math.floor((outcome.image.length * 3) / 16) })}</b>
            <Button className="button small" onPress={() => onOpen(outcome.image)}>
              {t("upload.openAsBlocks")}
            </Button>
          </div>
        </div>
      );
  }
}

function Told({ tone, title, text }: { tone: "success" | "warning" | "error"; title: string; text: string }) {
  return (
    <div className={`result ${tone}`} role={tone === "error" ? "alert" : "status"}>
      <Icon name={tone === "success" ? "done" : tone} />
      <div>
        <b>{title}</b>
        <p>{text}</p>
      </div>
    </div>
  );
}
