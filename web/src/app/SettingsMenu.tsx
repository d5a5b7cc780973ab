import { Header, Menu, MenuItem, MenuSection, MenuTrigger, Popover, type Selection } from "react-aria-components";
import { useTranslation } from "react-i18next";
import type { Language } from "../api/types";
import { changeLanguage, LANGUAGES, nameOf } from "../i18n";
import { IconButton } from "./controls";
import { Icon } from "./icons";
import { THEMES, useSettings, type ThemeName } from "./settings";

const only = (selection: Selection) => (selection === "all" ? undefined : [...selection][0]);

export function SettingsMenu() {
  const { t, i18n } = useTranslation();
  const theme = useSettings((settings) => settings.theme);
  return (
    <MenuTrigger>
      <IconButton icon="settings" label={t("settings.title")} />
      <Popover className="popover" placement="bottom end">
        <Menu className="menu" aria-label={t("settings.title")}>
          <MenuSection
            selectionMode="single"
            disallowEmptySelection
            selectedKeys={[i18n.language]}
            onSelectionChange={(keys) => changeLanguage(only(keys) as Language)}
          >
            <Header className="menu-title">{t("settings.language")}</Header>
            {LANGUAGES.map((language) => (
              <MenuItem key={language} id={language} className="menu-item" lang={language}>
                <Icon name="done" />
                {nameOf(language)}
              </MenuItem>
            ))}
          </MenuSection>
          <MenuSection
            selectionMode="single"
            disallowEmptySelection
            selectedKeys={[theme]}
            onSelectionChange={(keys) => useSettings.setState({ theme: only(keys) as ThemeName })}
          >
            <Header className="menu-title">{t("settings.theme")}</Header>
            {THEMES.map((name) => (
              <MenuItem key={name} id={name} className="menu-item">
                <Icon name="done" />
                {t(`settings.${name}`)}
              </MenuItem>
            ))}
          </MenuSection>
        </Menu>
      </Popover>
    </MenuTrigger>
  );
}
