import * as Blockly from "blockly/core";
import { useTranslation } from "react-i18next";
import { closeDialog } from "../state/dialogs";
import { useSettings } from "../state/settings";
import { Sheet, TextButton } from "../ui/controls";
import dialogs from "./dialogs.module.css";

interface Shortcut {
  name: string;
  text: string;
  keys: string[];
}

const spelled = (key: string) =>
  key
    .split("+")
    .map((part) => (/^\d+$/.test(part) ? (NAMES[part] ?? String.fromCharCode(Number(part))) : part))
    .join(" + ");

/** Of keys whose code is no letter of theirs. */
const NAMES: Record<string, string> = {
  8: "Backspace",
  9: "Tab",
  13: "Enter",
  27: "Esc",
  32: "Space",
  33: "Page Up",
  34: "Page Down",
  35: "End",
  36: "Home",
  37: "←",
  38: "↑",
  39: "→",
  40: "↓",
  46: "Delete",
  93: "Menu",
  121: "F10",
  191: "/",
};

/** Blockly's keyboard shortcuts that have a text, each with its keys. */
function editorShortcuts(): Shortcut[] {
  const registry = Blockly.ShortcutRegistry.registry;
  return Object.values(registry.getRegistry()).flatMap(({ name, displayText }) => {
    const text = typeof displayText === "function" ? displayText() : displayText;
    const keys = registry.getKeyCodesByShortcutName(name).map(spelled);
    return text && keys.length ? [{ name, text, keys: [...new Set(keys)] }] : [];
  });
}

const TOPICS = ["blocks", "words", "mat", "upload"] as const;
const PAGE_KEYS = { tab: "Tab", blocks: "← ↑ → ↓", words: "← ↑ → ↓", divider: "← →", undo: "Ctrl + Z", redo: "Ctrl + Y", save: "Ctrl + S", full: "F", projector: "B", chase: "C", sound: "M", help: "/" } as const;

export function HelpDialog() {
  const { t } = useTranslation();
  const rows = [
    ...Object.entries(PAGE_KEYS).map(([name, keys]) => ({
      name,
      text: t(`help.keys.${name as keyof typeof PAGE_KEYS}`),
      keys: [keys as string],
    })),
    ...editorShortcuts(),
  ];
  return (
    <Sheet title={t("help.title")} wide>
      <ul className={dialogs.helpTopics}>
        {TOPICS.map((topic) => (
          <li key={topic}>
            <b>{t(`help.topics.${topic}.title`)}</b> {t(`help.topics.${topic}.text`)}
          </li>
        ))}
      </ul>
      <TextButton
        onPress={() => {
          closeDialog();
          useSettings.setState({ toured: false });
        }}
      >
        {t("tour.again")}
      </TextButton>
      <h3>{t("help.shortcuts")}</h3>
      <dl className={dialogs.shortcuts}>
        {rows.map(({ name, text, keys }) => (
          <div key={name}>
            <dt>{text}</dt>
            <dd>
              {keys.map((key) => (
                <kbd key={key}>{key}</kbd>
              ))}
            </dd>
          </div>
        ))}
      </dl>
    </Sheet>
  );
}
