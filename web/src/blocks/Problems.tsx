import { Button } from "react-aria-components";
import type { Diagnostic } from "../api/types";
import { inLanguage, useTexts } from "../i18n";
import { useMat } from "../mat/store";
import { usePython } from "../python/text";
import { openDrawer, useSettings } from "../state/settings";
import { useStudio } from "../state/studio";
import { useTour } from "../state/tour";
import { Icon } from "../ui/icons";
import { FixButtons } from "./fixes";
import { showBlock } from "./workspaces";
import css from "./blocks.module.css";

/** The diagnostics, those with the same sentence and no other button together. */
function bySentence(diagnostics: readonly Diagnostic[]): Diagnostic[][] {
  const groups = new Map<string, Diagnostic[]>();
  diagnostics.forEach((each, index) => {
    const key = each.editor && !each.fixes?.length ? `${each.code} ${inLanguage(each.sentence)}` : String(index);
    groups.set(key, [...(groups.get(key) ?? []), each]);
  });
  return [...groups.values()];
}

/** What is wrong with the project's Python text, where its own drawer doesn't say so. */
function useWrongText(): Diagnostic | undefined {
  const text = useStudio(({ python }) => python);
  const said = useSettings(({ drawer, level }) => level !== "python" || (drawer.open && drawer.tab === "python"));
  const wrong = usePython(({ text: read, diagnostics }) => (read === text ? diagnostics.find(({ severity }) => severity === "error") : undefined));
  return said ? undefined : wrong;
}

/** What the compiler says of the blocks, each with a link to its block. */
export function Problems() {
  const t = useTexts();
  const diagnostics = useStudio(({ compiled }) => compiled?.diagnostics);
  // Until cars were to drive, and while the tour says what to do, nobody is warned that they have no blocks yet.
  const tours = useTour(({ shows }) => shows);
  const isBegun = useMat(({ tMs }) => tMs > 0) && !tours;
  const shown = diagnostics?.filter(({ code }) => isBegun || code !== "empty-program");
  const loose = useStudio((studio) => studio.loose[0]);
  const wrongText = useWrongText();
  if (!shown?.length && !loose && !wrongText) return null;
  return (
    <ul className={css.diagnostics} aria-label={t("words.diagnostics")}>
      {wrongText && (
        <li className="caution" data-severity="error">
          <Icon name="error" />
          <Button className={css.diagnostic} onPress={() => openDrawer("python")}>
            {t("python.wrong", { line: wrongText.place?.line ?? 1, sentence: inLanguage(wrongText.sentence) })}
          </Button>
        </li>
      )}
      {loose && (
        <li className="caution" data-severity="warning">
          <Icon name="warning" />
          <Button className={css.diagnostic} onPress={() => showBlock(loose.editor, loose.block)}>
            {t("editors.loose")}
          </Button>
        </li>
      )}
      {bySentence(shown ?? []).map((group, index) => (
        <li className="caution" key={`${group[0]!.code} ${group[0]!.path} ${index}`} data-severity={group[0]!.severity}>
          <Icon name={group[0]!.severity} />
          <span>
            {group.map(({ path, block, editor, sentence }, at) => {
              const isLast = at === group.length - 1;
              const name = editor && <b>{t(`editors.${editor}`) + (isLast ? "" : " ·")}</b>;
              const last = isLast && inLanguage(sentence);
              return block && editor ? (
                <Button key={path} className={css.diagnostic} onPress={() => showBlock(editor, block)}>
                  {name} {last}
                </Button>
              ) : (
                <span key={path}>
                  {name} {last}
                </span>
              );
            })}
          </span>
          <FixButtons diagnostic={group[0]!} />
        </li>
      ))}
    </ul>
  );
}
