import { Menu, MenuItem, MenuTrigger, Popover, Text } from "react-aria-components";
import { useTranslation } from "react-i18next";
import { type Level, LEVELS, openDrawer, useSettings } from "../state/settings";
import { Icon } from "../ui/icons";
import { collectEdits } from "../words/compiling";
import { TextButton } from "../ui/controls";
import css from "./app.module.css";
import controls from "../ui/controls.module.css";

/** Show more or less of the page; what a new level brings opens at once. */
function choose(level: Level): void {
  // The editors are created anew: blocks of another level look otherwise.
  collectEdits();
  useSettings.setState({ level });
  if (level !== "start") openDrawer(level);
}

/** The level of the page, and what each level brings. */
export function LevelMenu() {
  const { t } = useTranslation();
  const level = useSettings((settings) => settings.level);
  const name = t("level.button", { level: t(`level.${level}`) });
  return (
    <MenuTrigger>
      <TextButton quiet aria-label={name}>
        <Icon name="levels" />
        <span className={css.buttonText}>{name}</span>
      </TextButton>
      <Popover className={controls.popover} placement="bottom end">
        <Menu
          className={controls.menu}
          aria-label={t("level.title")}
          selectionMode="single"
          disallowEmptySelection
          selectedKeys={[level]}
          onAction={(key) => choose(key as Level)}
        >
          {LEVELS.map((each) => (
            <MenuItem key={each} id={each} className={controls.menuItem} textValue={t(`level.${each}`)}>
              <Icon name="done" />
              <span className={css.level}>
                <Text slot="label">{t(`level.${each}`)}</Text>
                <Text slot="description">{t(`level.${each}About`)}</Text>
              </span>
            </MenuItem>
          ))}
        </Menu>
      </Popover>
    </MenuTrigger>
  );
}
