import * as Blockly from "blockly/core";
import { useTexts } from "../i18n";
import { closeDialog } from "../state/dialogs";
import { Sheet, TextButton } from "../ui/controls";
import { begin } from "./Tour";
import dialogs from "./dialogs.module.css";

/** Of keys that are called otherwise than Blockly calls them. */
const NAMES: Record<string, string> = { LEFT: "←", UP: "↑", RIGHT: "→", DOWN: "↓", MAC_WK_CMD_RIGHT: "Menu", SLASH: "/" };

function keyName(code: string): string {
  const name = Blockly.utils.KeyCodes[Number(code)] ?? code;
  return NAMES[name] ?? name.toLowerCase().replaceAll("_", " ").replace(/\b[a-z]/g, (letter) => letter.toUpperCase());
}

const spelled = (keys: string) => keys.split("+").map(keyName).join(" + ");

/** Blockly's keyboard shortcuts that have a text, each with its keys. */
function editorShortcuts() {
  const registry = Blockly.ShortcutRegistry.registry;
  return Object.values(registry.getRegistry()).flatMap(({ name, displayText }) => {
    const text = typeof displayText === "function" ? displayText() : displayText;
    const keys = registry.getKeyCodesByShortcutName(name).map(spelled);
    return text && keys.length ? [{ name, text, keys: [...new Set(keys)] }] : [];
  });
}

const TOPICS = ["blocks", "words", "mat", "upload"] as const;
const PAGE_KEYS = {
  tab: "Tab",
  blocks: "← ↑ → ↓",
  words: "← ↑ → ↓",
  divider: "← →",
  undo: "Ctrl + Z",
  redo: "Ctrl + Y",
  save: "Ctrl + S",
  full: "F",
  projector: "B",
  chase: "C",
  sound: "M",
  help: "/",
} as const;

export function HelpDialog() {
  const t = useTexts();
  const again = () => {
    closeDialog();
    begin();
  };
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
      <ul className="stack">
        {TOPICS.map((topic) => (
          <li key={topic}>
            <b>{t(`help.topics.${topic}.title`)}</b> {t(`help.topics.${topic}.text`)}
          </li>
        ))}
      </ul>
      <TextButton onPress={again}>{t("tour.again")}</TextButton>
      <h3>{t("help.shortcuts")}</h3>
      <dl className={dialogs.shortcuts}>
        {rows.map(({ name, text, keys }) => (
          <div key={name} className="row apart">
            <dt>{text}</dt>
            <dd className="wrap">
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
