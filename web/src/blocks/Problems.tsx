import { Button } from "react-aria-components";
import { useTranslation } from "react-i18next";
import { inLanguage } from "../i18n";
import { useStudio } from "../state/studio";
import { Icon } from "../ui/icons";
import { MendButtons } from "./MendButtons";
import { showBlock } from "./workspaces";
import css from "./blocks.module.css";

/** What the compiler says of the blocks, each with a link to its block. */
export function Problems() {
  const { t } = useTranslation();
  const diagnostics = useStudio(({ compiled }) => compiled?.diagnostics);
  if (!diagnostics?.length) return null;
  return (
    <ul className={css.diagnostics} aria-label={t("words.diagnostics")}>
      {diagnostics.map((diagnostic, index) => {
        const { code, severity, sentence, path, block, editor } = diagnostic;
        return (
        <li key={`${code} ${path} ${index}`} data-severity={severity}>
          <Icon name={severity} />
          {block && editor ? (
            <Button className={css.diagnostic} onPress={() => showBlock(editor, block)}>
              <b>{t(`editors.${editor}`)}</b> {inLanguage(sentence)}
            </Button>
          ) : (
            <span className={css.diagnostic}>
              {editor && <b>{t(`editors.${editor}`)}</b>} {inLanguage(sentence)}
            </span>
          )}
          <MendButtons diagnostic={diagnostic} />
        </li>
        );
      })}
    </ul>
  );
}
