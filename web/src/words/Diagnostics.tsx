import { Button } from "react-aria-components";
import { useTranslation } from "react-i18next";
import type { Diagnostic } from "../api/types";
import { Icon } from "../app/icons";
import { showBlock } from "../blocks/workspaces";
import { inLanguage } from "../i18n";

/** What the compiler has to say; each sentence leads to its block. */
export function Diagnostics({ diagnostics }: { diagnostics: readonly Diagnostic[] }) {
  const { t } = useTranslation();
  return (
    <ul className="diagnostics" aria-label={t("words.diagnostics")}>
      {diagnostics.map(({ code, severity, sentence, path, block, editor }, index) => (
        <li key={`${code} ${path} ${index}`} className={severity}>
          <Icon name={severity} />
          {block && editor ? (
            <Button className="diagnostic" onPress={() => showBlock(editor, block)}>
              <b>{t(`editors.${editor}`)}</b> {inLanguage(sentence)}
            </Button>
          ) : (
            <span className="diagnostic">
              {editor && <b>{t(`editors.${editor}`)}</b>} {inLanguage(sentence)}
            </span>
          )}
        </li>
      ))}
    </ul>
  );
}
