import { Button } from "react-aria-components";
import type { EditorName } from "../api/types";
import { NO_INDEX, type Picture } from "../api/world";
import { findText } from "../blocks/workspaces";
import { useTexts } from "../i18n";
import { isStart, useSettings } from "../state/settings";
import { useWords } from "../state/studio";
import { Icon } from "../ui/icons";
import { LOSS_SIGNS } from "./carPaint";
import { colourWords, hexColour } from "./colours";
import { useShown } from "./useShown";
import css from "./mat.module.css";

const MOST_COLOURS = 6;

function heldWords(picture: Picture | null): string {
  const held = new Set<number>();
  for (const index of picture?.index ?? []) if (index !== NO_INDEX) held.add(index);
  return [...held].sort((a, b) => a - b).slice(0, MOST_COLOURS).join();
}

/** What the colours of the cars mean: the blocks whose words they hold now. Closed, only the colours show. */
export function Legend() {
  const t = useTexts();
  const words = useWords();
  const open = useSettings((settings) => settings.legend);
  const marksShow = !useSettings(isStart);
  const held = useShown(heldWords);
  const { strong } = colourWords(words);
  // A block may make several words.
  const entries = new Map<string, { part: EditorName; block: string; colours: string[] }>();
  for (const index of held ? held.split(",").map(Number) : []) {
    const word = words[index];
    if (!word || word.part === "header" || word.block === null) continue;
    const key = `${word.part} ${word.block}`;
    const entry = entries.get(key) ?? { part: word.part, block: word.block, colours: [] };
    entries.set(key, { ...entry, colours: [...entry.colours, hexColour(strong[index]!)] });
  }
  if (!entries.size) return null;
  const all = [...entries];
  return (
    <div className={css.legend}>
      <Button
        className={css.legendButton}
        aria-expanded={open}
        aria-label={t("mat.legend")}
        onPress={() => useSettings.setState({ legend: !open })}
      >
        {!open && all.flatMap(([key, { colours }]) => colours.map((colour) => <i key={`${key} ${colour}`} style={{ background: colour }} />))}
        {open && <span>{t("mat.legend")}</span>}
        <Icon name={open ? "up" : "down"} />
      </Button>
      {open && (
        <ul aria-label={t("mat.legend")}>
          {all.map(([key, { part, block, colours }]) => (
            <li key={key}>
              {colours.map((colour) => (
                <i key={colour} style={{ background: colour }} />
              ))}
              <span>
                {t(`editors.${part}`)}: {findText(part, block)}
              </span>
            </li>
          ))}
          {marksShow &&
            (["missed", "collision"] as const).map((mark) => (
              <li key={mark} data-mark={mark}>
                <svg viewBox="-1 -1 2 2" aria-hidden="true">
                  <path d={LOSS_SIGNS[mark]} />
                  <path d={LOSS_SIGNS[mark]} />
                </svg>
                <span>{t(`mat.marks.${mark}`)}</span>
              </li>
            ))}
        </ul>
      )}
    </div>
  );
}
