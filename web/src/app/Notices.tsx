import { Button } from "react-aria-components";
import { useTranslation } from "react-i18next";
import { IconButton } from "../ui/controls";
import { Icon } from "../ui/icons";
import { dismiss, useDialogs } from "../state/dialogs";
import { useStudio } from "../state/studio";
import css from "./app.module.css";
import dialogs from "./dialogs.module.css";
import buttons from "../ui/buttons.module.css";
import { classes } from "../ui/classes";


/** Notices in a corner of the page; screen readers read them out. */
export function Notices() {
  const { t } = useTranslation();
  const notices = useDialogs((state) => state.notices);
  return (
    <div className={dialogs.notices} role="log" aria-live="polite" aria-label={t("app.notices")}>
      {notices.map(({ id, text, tone, action }) => (
        <div key={id} className={dialogs.notice} data-tone={tone}>
          <span>{text}</span>
          {action && (
            <Button
              className={classes(buttons.button, buttons.small)}
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
    <div className={css.serverBanner} role="alert">
      {gone && (
        <p>
          <Icon name="warning" />
          {t("server.gone")}
        </p>
      )}
    </div>
  );
}
