import { Button, Header as MenuTitle, Input, MenuSection, Separator, Text, TextField } from "react-aria-components";
import { changeLanguage, languages, nameOf, useLanguage, useTexts } from "../i18n";
import { exportCsv, exportPicture, openFile, save, saveFile, startNew } from "../projects/actions";
import { notify, openDialog } from "../state/dialogs";
import { redo, undo, useHistory } from "../state/history";
import { type Level, LEVELS, openDrawer, THEMES, useSettings } from "../state/settings";
import { useStudio } from "../state/studio";
import { Entry, IconButton, MenuButton, TextButton } from "../ui/controls";
import { Icon } from "../ui/icons";
import { print } from "../ui/panes";
import { collectEdits } from "../words/compiling";
import css from "./app.module.css";
import buttons from "../ui/buttons.module.css";
import controls from "../ui/controls.module.css";
import { classes } from "../ui/classes";

/** A leader and two followers. */
function Logo() {
  return (
    <svg className="rigid" width="30" height="30" viewBox="0 0 32 32" aria-hidden="true">
      <rect width="32" height="32" rx="8" fill="var(--accent)" />
      <path d="M16 4.5 22.5 17h-13z" fill="var(--on-accent)" />
      <path d="M8.5 18 12 26H5zM23.5 18 27 26H20z" fill="#ffc94d" />
    </svg>
  );
}

type FileText =
  | `menu.${"new" | "open" | "examples" | "library" | "save" | "saveFile" | "share" | "upload" | "calibrate"}`
  | `export.${"csv" | "svg" | "png" | "print"}`;

function FileMenu() {
  const t = useTexts();
  const item = (text: FileText, run: () => void) => (
    <Entry id={text} onAction={run}>
      {t(text)}
    </Entry>
  );
  const button = (
    <TextButton quiet>
      <Icon name="file" />
      <span className={css.buttonText}>{t("menu.project")}</span>
    </TextButton>
  );
  return (
    <MenuButton button={button} placement="bottom start" aria-label={t("menu.project")}>
      {item("menu.new", () => void startNew())}
      {item("menu.open", () => void openFile())}
      {item("menu.examples", () => openDialog("examples"))}
      <Separator className={controls.menuLine} />
      {item("menu.save", () => void save())}
      {item("menu.library", () => openDialog("library"))}
      {item("menu.saveFile", () => void saveFile())}
      {item("menu.share", () => openDialog("share"))}
      <Separator className={controls.menuLine} />
      {item("menu.upload", () => openDialog("upload"))}
      {item("menu.calibrate", () => openDialog("calibration"))}
      <Separator className={controls.menuLine} />
      <MenuSection>
        <MenuTitle className={controls.menuTitle}>{t("export.title")}</MenuTitle>
        {item("export.csv", exportCsv)}
        {item("export.svg", () => void exportPicture("svg"))}
        {item("export.png", () => void exportPicture("png"))}
        {item("export.print", print)}
      </MenuSection>
    </MenuButton>
  );
}

/** Show more or less of the page; what a new level brings opens at once. */
function chooseLevel(level: Level): void {
  // The editors are created anew: blocks of another level look otherwise.
  collectEdits();
  useSettings.setState({ level });
  if (level !== "start") openDrawer(level);
}

/** The level of the page, and what each level brings. */
function LevelMenu() {
  const t = useTexts();
  const level = useSettings((settings) => settings.level);
  const name = t("level.button", { level: t(`level.${level}`) });
  const button = (
    <TextButton quiet aria-label={name}>
      <Icon name="levels" />
      <span className={css.buttonText}>{name}</span>
    </TextButton>
  );
  return (
    <MenuButton
      button={button}
      placement="bottom end"
      aria-label={t("level.title")}
      selectionMode="single"
      disallowEmptySelection
      selectedKeys={[level]}
      onAction={(key) => chooseLevel(key as Level)}
    >
      {LEVELS.map((each) => (
        <Entry key={each} id={each} textValue={t(`level.${each}`)}>
          <Icon name="done" />
          <span className={css.level}>
            <Text slot="label">{t(`level.${each}`)}</Text>
            <Text slot="description" className="quiet small">{t(`level.${each}About`)}</Text>
          </span>
        </Entry>
      ))}
    </MenuButton>
  );
}

function SettingsMenu() {
  const t = useTexts();
  const language = useLanguage();
  const theme = useSettings((settings) => settings.theme);
  return (
    <MenuButton button={<IconButton icon="settings" label={t("settings.title")} />} placement="bottom end" aria-label={t("settings.title")}>
      <MenuSection selectionMode="single" disallowEmptySelection selectedKeys={[language]}>
        <MenuTitle className={controls.menuTitle}>{t("settings.language")}</MenuTitle>
        {languages().map((each) => (
          <Entry key={each} id={each} lang={each} onAction={() => void changeLanguage(each).catch(() => notify(t("settings.noTexts"), "warning"))}>
            <Icon name="done" />
            {nameOf(each)}
          </Entry>
        ))}
      </MenuSection>
      <MenuSection selectionMode="single" disallowEmptySelection selectedKeys={[theme]}>
        <MenuTitle className={controls.menuTitle}>{t("settings.theme")}</MenuTitle>
        {THEMES.map((name) => (
          <Entry key={name} id={name} onAction={() => useSettings.setState({ theme: name })}>
            <Icon name="done" />
            {t(`settings.${name}`)}
          </Entry>
        ))}
      </MenuSection>
      <Separator className={controls.menuLine} />
      <Entry id="help" onAction={() => openDialog("help")}>
        {t("help.title")}
      </Entry>
    </MenuButton>
  );
}

/** Whether a file or the library holds what is on the page. */
function Saved() {
  const t = useTexts();
  const unsaved = useStudio((studio) => studio.unsaved);
  const stored = useStudio((studio) => studio.stored);
  return (
    <span className={css.saved} role="status" data-tone={unsaved ? "warning" : "success"}>
      {stored && !unsaved && <Icon name="done" />}
      {(stored || unsaved) && <span>{t(unsaved ? "project.unsaved" : "project.saved")}</span>}
    </span>
  );
}

function History() {
  const t = useTexts();
  const canUndo = useHistory(({ done }) => done.length > 0);
  const canRedo = useHistory(({ undone }) => undone.length > 0);
  return (
    <>
      <IconButton icon="undo" label={t("history.undo")} isDisabled={!canUndo} onPress={undo} />
      <IconButton icon="redo" label={t("history.redo")} isDisabled={!canRedo} onPress={redo} />
    </>
  );
}

/** The project's name and menu, undo and redo, and the settings of the page. */
export function Header() {
  const t = useTexts();
  const name = useStudio((studio) => studio.name);
  return (
    <header className={css.header}>
      <h1 className={css.brand}>
        <Logo />
        <span>{t("app.title")}</span>
      </h1>
      <TextField
        className={css.projectName}
        aria-label={t("project.name")}
        value={name}
        onChange={(text) => useStudio.setState({ name: text })}
      >
        <Input maxLength={80} placeholder={t("project.unnamed")} />
      </TextField>
      <Saved />
      <div className="unprinted row flush end">
        <History />
        <TextButton quiet onPress={() => openDialog("missions")}>
          <Icon name="star" />
          <span className={css.buttonText}>{t("missions.title")}</span>
        </TextButton>
        {/* A phone has no room for these two: they stand in the menus too. */}
        <Button className={classes(buttons.button, buttons.quietButton, css.roomy)} onPress={() => openDialog("examples")}>
          <Icon name="examples" />
          <span className={css.buttonText}>{t("menu.examplesShort")}</span>
        </Button>
        <FileMenu />
        <LevelMenu />
        <SettingsMenu />
        <span className={css.roomy}>
          <IconButton icon="help" label={t("help.title")} onPress={() => openDialog("help")} />
        </span>
      </div>
    </header>
  );
}
