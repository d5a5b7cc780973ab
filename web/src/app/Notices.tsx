import { Button } from "react-aria-components";
import { useTranslation } from "react-i18next";
import { IconButton } from "./controls";
import { Icon } from "./icons";
import { dismiss, useNotices } from "./telling";
import { useStudio } from "./store";

/** Short words to the user, in a corner and in the screen reader's ear. */
export function Notices() {
  const { t } = useTranslation();
  const notices = useNotices((state) => state.notices);
  return (
    <div className="notices" role="log" aria-live="polite" aria-label={t("app.notices")}>
      {notices.map(({ id, text, tone, action }) => (
        <div key={id} className={`notice ${tone}`}>
          <span>{text}</span>
          {action && (
            <Button
              className="button small"
              onPress={() => {
                dismiss(id);
                action.run();
              }}
            >
              {action.label}
            </Button>
          )}
          <IconButton icon="close" label={t("app.dismiss")} onPress={() => dismiss(id)} />
        </div>
      ))}
    </div>
  );
}

export function ServerBanner() {
  const { t } = useTranslation();
  const gone = useStudio((studio) => studio.serverGone);
  return (
    <div className="server-banner" role="alert">
      {gone && (
        <p>
          <Icon name="warning" />
          {t("server.gone")}
        </p>
      )}
    </div>
  );
}
