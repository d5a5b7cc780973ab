import { useEffect, useRef, useState, type KeyboardEvent } from "react";
import { useTranslation } from "react-i18next";
import type { CompiledWord, EditorName, Field, Formats, Profile } from "../api/types";
import { useStudio } from "../app/store";
import { withInner } from "../blocks/workspaces";
import { hasBlockIn, spansOf } from "./bits";
import { fieldMeaning } from "./meaning";
import { useRows } from "./rows";
import { leadToBlock, WordRow, type Place } from "./WordRow";

interface WordTableProps {
  words: readonly CompiledWord[];
  formats: Formats;
  profile: Profile;
}

const fieldsOf = (formats: Formats, word: CompiledWord): Field[] =>
  word.part === "header" ? formats.header : formats.control;
const clamp = (value: number, most: number) => Math.max(0, Math.min(most, value));
const NOTHING: ReadonlySet<string> = new Set();

function useLitBlocks(): { editor: EditorName | null; blocks: ReadonlySet<string> } {
  const selection = useStudio((studio) => studio.selection);
  if (!selection) return { editor: null, blocks: NOTHING };
  return { editor: selection.editor, blocks: withInner(selection.editor, selection.block) };
}

/** The image's words. Arrow keys walk through its fields; Enter or a click leads to a field's block. */
export function WordTable({ words, formats, profile }: WordTableProps) {
  const { t } = useTranslation();
  const [place, setPlace] = useState<Place>({ row: 0, field: 0 });
  const scroller = useRef<HTMLDivElement>(null);
  const { first, last, height, offset, bringIntoView } = useRows(scroller, words.length);
  const { editor, blocks } = useLitBlocks();
  const row = clamp(place.row, words.length - 1);
  const word = words[row]!;
  const field = fieldsOf(formats, word)[clamp(place.field, fieldsOf(formats, word).length - 1)]!;

  useEffect(() => {
    const lit = words.findIndex((each) => each.part === editor && each.block !== null && blocks.has(each.block));
    if (lit >= 0) bringIntoView(lit);
    // Only a new selection scrolls; new words under an old one would pull the table from under the reader.
    // eslint-disable-next-line react-hooks/exhaustive-deps
  }, [editor, [...blocks][0]]);

  const walk = (event: KeyboardEvent) => {
    const steps: Record<string, [rows: number, fields: number]> = {
      ArrowDown: [1, 0],
      ArrowUp: [-1, 0],
      ArrowRight: [0, 1],
      ArrowLeft: [0, -1],
      PageDown: [10, 0],
      PageUp: [-10, 0],
      Home: [0, -99],
      End: [0, 99],
    };
    if (event.key === "Enter" || event.key === " ") leadToBlock(word, field.name);
    const step = steps[event.key];
    if (step || event.key === " ") event.preventDefault();
    if (!step) return;
    const nextRow = clamp(row + step[0], words.length - 1);
    const most = fieldsOf(formats, words[nextRow]!).length - 1;
    bringIntoView(nextRow);
    setPlace({ row: nextRow, field: clamp(Math.min(place.field, most) + step[1], most), walked: true });
  };

  return (
    <>
      <div className="word-scroller" ref={scroller}>
        <div className="word-head" aria-hidden="true">
          {spansOf(formats.control).map(({ group, fields }, index) => (
            <span key={index} className={`span ${group}`} style={{ "--bits": fields.at(0)!.high - fields.at(-1)!.low + 1, "--gaps": fields.length - 1 } as React.CSSProperties}>
              <small>{t(`groups.${group}`)}</small>
            </span>
          ))}
        </div>
        <div role="grid" aria-label={t("words.table")} aria-rowcount={words.length} className="word-grid" style={{ height }} onKeyDown={walk}>
          <div role="rowgroup" style={{ transform: `translateY(${offset}px)` }}>
            {words.slice(first, last).map((each, index) => (
              <WordRow
                key={first + index}
                index={first + index}
                word={each}
                fields={fieldsOf(formats, each)}
                profile={profile}
                lit={each.part === editor && hasBlockIn(each, blocks) ? blocks : NOTHING}
                place={first + index === row ? place : null}
                onPlace={setPlace}
              />
            ))}
          </div>
        </div>
      </div>
      <p className="word-detail" aria-hidden="true">
        <b>{t("words.word", { index: row })}</b> {fieldMeaning(word, field, profile)}
      </p>
    </>
  );
}
