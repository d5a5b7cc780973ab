import { Button, Header, Menu, MenuItem, MenuSection, MenuTrigger, Popover, Separator } from "react-aria-components";
import { useTranslation } from "react-i18next";
import { exportCsv, exportPicture, openFile, saveFile, saveToLibrary } from "../projects/actions";
import { startNew } from "../projects/opening";
import type { DialogName } from "./Dialogs";
import { Icon } from "./icons";

export function FileMenu({ onDialog }: { onDialog: (dialog: DialogName) => void }) {
  const { t } = useTranslation();
  const save = async () => {
    if (!(await saveToLibrary())) onDialog("library");
  };
  const item = (key: "new" | "open" | "examples" | "library" | "save" | "saveFile" | "share", run: () => void) => (
    <MenuItem className="menu-item" id={key} onAction={run}>
      {t(`menu.${key}`)}
    </MenuItem>
  );
  const exported = (key: "csv" | "svg" | "png" | "print", run: () => void) => (
    <MenuItem className="menu-item" id={key} onAction={run}>
      {t(`export.${key}`)}
    </MenuItem>
  );
  return (
    <MenuTrigger>
      <Button className="button quiet-button">
        <Icon name="file" />
        <span className="button-text">{t("menu.project")}</span>
      </Button>
      <Popover className="popover" placement="bottom start">
        <Menu className="menu" aria-label={t("menu.project")}>
          {item("new", () => void startNew())}
          {item("open", () => void openFile())}
          {item("examples", () => onDialog("examples"))}
          <Separator className="menu-line" />
          {item("save", () => void save())}
          {item("library", () => onDialog("library"))}
          {item("saveFile", () => void saveFile())}
          {item("share", () => onDialog("share"))}
          <Separator className="menu-line" />
          <MenuSection>
            <Header className="menu-title">{t("export.title")}</Header>
            {exported("csv", exportCsv)}
            {exported("svg", () => void exportPicture("svg"))}
            {exported("png", () => void exportPicture("png"))}
            {exported("print", () => window.print())}
          </MenuSection>
        </Menu>
      </Popover>
    </MenuTrigger>
  );
}
