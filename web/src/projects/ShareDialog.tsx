import { useEffect, useState } from "react";
import { Button, Input, Label, TextField } from "react-aria-components";
import { useTranslation } from "react-i18next";
import { Sheet } from "../app/controls";
import { attempt, shareLink } from "./actions";

/** A link that holds the project itself. */
export function ShareDialog({ onClose }: { onClose: () => void }) {
  const { t } = useTranslation();
  const [link, setLink] = useState("");
  const [copied, setCopied] = useState(false);
  useEffect(() => void attempt(async () => setLink(await shareLink())), []);
  const copy = () =>
    navigator.clipboard.writeText(link).then(
      () => setCopied(true),
      () => setCopied(false),
    );
  return (
    <Sheet title={t("share.title")} onClose={onClose}>
      <p>{t("share.about")}</p>
      <div className="share-row">
        <TextField value={link} isReadOnly>
          <Label>{t("share.link")}</Label>
          <Input onFocus={(event) => event.target.select()} />
        </TextField>
        <Button className="button primary" onPress={() => void copy()} isDisabled={!link}>
          {t("share.copy")}
        </Button>
      </div>
      <p role="status" className="quiet">
        {copied ? t("share.copied") : t("share.length", { count: link.length })}
      </p>
    </Sheet>
  );
}
