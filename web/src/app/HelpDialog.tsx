import { Button } from "react-aria-components";
import { useTranslation } from "react-i18next";
import { Sheet } from "./controls";
import { useSettings } from "./settings";
import { editorShortcuts } from "./shortcuts";

const TOPICS = ["blocks", "words", "mat", "upload"] as const;
const PAGE_KEYS = { tab: "Tab", blocks: "← ↑ → ↓", words: "← ↑ → ↓", divider: "← →", help: "/" } as const;

export function HelpDialog({ onClose }: { onClose: () => void }) {
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
    <Sheet title={t("help.title")} onClose={onClose} wide>
      <ul className="help-topics">
        {TOPICS.map((topic) => (
          <li key={topic}>
            <b>{t(`help.topics.${topic}.title`)}</b> {t(`help.topics.${topic}.text`)}
          </li>
        ))}
      </ul>
      <Button
        className="button"
        onPress={() => {
          onClose();
          useSettings.setState({ toured: false });
        }}
      >
        {t("tour.again")}
      </Button>
      <h3>{t("help.shortcuts")}</h3>
      <dl className="shortcuts">
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
