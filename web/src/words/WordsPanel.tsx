import type { CSSProperties } from "react";
import { Label, Meter } from "react-aria-components";
import type { Costliest, EditorName } from "../api/types";
import { findText, showBlock } from "../blocks/workspaces";
import { useTexts } from "../i18n";
import { useStudio } from "../state/studio";
import { WordTable } from "./WordTable";
import { classes } from "../ui/classes";
import { TextButton } from "../ui/controls";
import areas from "../ui/areas.module.css";
import css from "./words.module.css";

/** From this share of the limit on, the block that needs most words is named. */
const NEAR = 0.75;

function Gauge({ editor, used, most, costliest }: { editor: EditorName; used: number; most: number; costliest: Costliest | null }) {
  const t = useTexts();
  const near = used >= most * NEAR;
  const block = costliest?.block;
  return (
    <div className={css.gauge} data-tone={used > most ? "error" : near ? "warning" : undefined}>
      <Meter className={"row small"} value={Math.min(used, most)} maxValue={most} valueLabel={t("words.used", { used, most })}>
        {({ percentage, valueText }) => (
          <>
            <Label>{t(`words.${editor}Used`)}</Label>
            <span className={css.gaugeBar}>
              <span style={{ width: `${percentage}%`, "--accent": `var(--${editor})` } as CSSProperties} />
            </span>
            <span className={classes("figures", css.gaugeValue)}>{valueText}</span>
          </>
        )}
      </Meter>
      {near && block && (
        <TextButton link onPress={() => showBlock(editor, block)}>
          {t("words.costliest", { block: findText(editor, block), count: costliest.count })}
        </TextButton>
      )}
    </div>
  );
}

/** The words of the program, compiled anew with every change. */
export function WordsPanel() {
  const t = useTexts();
  const compiled = useStudio((studio) => studio.compiled);
  const profile = useStudio((studio) => studio.profileFigures);
  const followed = useStudio((studio) => studio.followers !== null);

  return (
    <>
      <header className={classes(areas.paneHead, css.head)}>
        {compiled && (
          <div className={css.gauges}>
            <Gauge editor="leader" used={compiled.states} most={compiled.most} costliest={compiled.costliest.leader} />
            {followed && (
              <Gauge
                editor="followers"
                used={compiled.follower_words}
                most={compiled.most}
                costliest={compiled.costliest.followers}
              />
            )}
          </div>
        )}
      </header>
      {compiled && compiled.words.length > 0 && profile ? (
        <WordTable words={compiled.words} profile={profile} />
      ) : (
        <p className={css.empty}>{t("words.none")}</p>
      )}
    </>
  );
}
