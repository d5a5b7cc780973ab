import { Button, Input, TextField } from "react-aria-components";
import { useTranslation } from "react-i18next";
import { IconButton } from "./controls";
import { FileMenu } from "./FileMenu";
import { Icon } from "./icons";
import { Logo } from "./Logo";
import { SettingsMenu } from "./SettingsMenu";
import { useStudio } from "./store";
import type { DialogName } from "./Dialogs";

/** The project's name, what can be done with it, and how the page looks and speaks. */
export function Header({ onDialog }: { onDialog: (dialog: DialogName) => void }) {
  const { t } = useTranslation();
  const name = useStudio((studio) => studio.name);
  const unsaved = useStudio((studio) => studio.unsaved);
  return (
    <header className="header">
      <h1 className="brand">
        <Logo />
        <span>{t("app.title")}</span>
      </h1>
      <TextField
        className="project-name"
        aria-label={t("project.name")}
        value={name}
        onChange={(text) => useStudio.setState({ name: text })}
      >
        <Input maxLength={80} placeholder={t("project.unnamed")} />
      </TextField>
      <span className="unsaved" role="status">
        {unsaved && t("project.unsaved")}
      </span>
      <div className="header-tools">
        <FileMenu onDialog={onDialog} />
        <Button className="button quiet-button roomy" onPress={() => onDialog("examples")}>
          <Icon name="examples" />
          {t("menu.examplesShort")}
        </Button>
        <Button className="button quiet-button roomy" onPress={() => onDialog("share")}>
          <Icon name="share" />
          {t("menu.shareShort")}
        </Button>
        <Button className="button primary" onPress={() => onDialog("upload")}>
          <Icon name="upload" />
          <span className="button-text">{t("upload.open")}</span>
        </Button>
        <SettingsMenu />
        <IconButton icon="help" label={t("help.title")} onPress={() => onDialog("help")} />
      </div>
    </header>
  );
}
