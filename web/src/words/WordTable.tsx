import { memo, type CSSProperties, type KeyboardEvent, type RefObject, useEffect, useMemo, useRef, useState } from "react";
import type { CompiledWord, EditorName, Field, Profile } from "../api/types";
import { conditionOf, withInner } from "../blocks/asked";
import { editorWith, showBlock } from "../blocks/workspaces";
import { FORMATS } from "../generated/steps";
import { useTexts } from "../i18n";
import { shownDecisions, useMat } from "../mat/store";
import { usePython } from "../python/text";
import { useSettings } from "../state/settings";
import { useStudio } from "../state/studio";
import { classes } from "../ui/classes";
import { usePrinting, useScroll } from "../ui/panes";
import { bitsOf, blockOf, colourOf, fieldsOf, hasBlockIn, isLit, isNarrow, spansOf, fieldMeaning } from "./bits";
import { Counters } from "./Counters";
import { askedKeyOf, askedBy, asks } from "./deciding";
import { storyOf } from "./story";
import { valueOf } from "./values";
import css from "./words.module.css";

const ROW_PX = 30;
const SPARE = 6;

/** Which rows are visible: to draw all 511 words of 15 fields would take a tenth of a second for each edit. */
function useRows(scroller: RefObject<HTMLElement | null>, count: number) {
  const seen = useScroll(scroller);
  const all = usePrinting();
  const first = all ? 0 : Math.max(0, Math.min(count - 1, Math.floor(seen.top / ROW_PX) - SPARE));
  const last = all ? count : Math.min(count, Math.ceil((seen.top + seen.height) / ROW_PX) + SPARE);
  const bringIntoView = (row: number) => {
    const { scrollTop = 0, clientHeight = 0 } = scroller.current ?? {};
    const top = row * ROW_PX;
    // The table's head lies above its first row.
    const bottom = top + 2 * ROW_PX;
    if (top < scrollTop) scroller.current?.scrollTo({ top });
    else if (bottom > scrollTop + clientHeight) scroller.current?.scrollTo({ top: bottom - clientHeight });
  };
  return { first, last, height: count * ROW_PX, offset: first * ROW_PX, bringIntoView };
}

/** Where in the table the user is. */
interface Place {
  row: number;
  field: number;
  /** Whether the user came there by keyboard; the focus then follows. */
  walked?: boolean;
}

interface WordRowProps {
  index: number;
  word: CompiledWord;
  fields: readonly Field[];
  profile: Profile;
  lit: ReadonlySet<string>;
  /** Whether its condition is met now. */
  isMet: boolean;
  /** The line of the Python text that made it, where that shows. */
  line: number | undefined;
  /** The user's place where it is in this row. */
  place: Place | null;
  onPlace: (place: Place) => void;
}

/** Show the block that a field comes from. */
function leadToBlock(word: CompiledWord, field: Field): void {
  const block = blockOf(word, field.name);
  if (word.part === "header" || !block) return;
  const condition = askedKeyOf(word, word.block, field) ? conditionOf(word.part, block, askedBy(word)!) : null;
  showBlock(word.part, condition ?? block);
}

/** Whether the block of a word stands in an editor: that of a follower's step may stand in the leader's. */
const isOf = (word: CompiledWord, editor: EditorName | null): boolean =>
  word.part === editor || (word.part === "followers" && word.block !== null && editorWith(word.part, word.block) === editor);

/** Drawn again only where its word or its highlighted fields change: its many labels take the most time of the page. */
const WordRow = memo(function WordRow(props: WordRowProps) {
  const { index, word, fields, profile, lit, isMet, line, place, onPlace } = props;
  const t = useTexts();
  const row = useRef<HTMLDivElement>(null);
  const active = place && Math.min(place.field, fields.length - 1);

  useEffect(() => {
    if (place?.walked) row.current?.querySelector<HTMLElement>('[tabindex="0"]')?.focus();
  }, [place]);

  return (
    <div
      role="row"
      aria-rowindex={index + 1}
      className={css.word}
      style={{ "--part": `var(--${word.part})` } as CSSProperties}
      data-hex={word.hex.toUpperCase()}
      ref={row}
    >
      <span role="rowheader" className={css.name}>
        <span className={css.index}>{index}</span>
        <span className={css.story}>{storyOf(word, profile)}</span>
        {line !== undefined && <span className={css.line}>{t("python.line", { line })}</span>}
        {/* The style sheet shows it behind the bits. */}
        <span className="unseen">{word.hex.toUpperCase()}</span>
        <span className="unseen">{t(`parts.${word.part}`)}</span>
      </span>
      {fields.map((field, at) => (
        <span
          key={field.name}
          role="gridcell"
          tabIndex={at === active ? 0 : -1}
          className={css.field}
          data-narrow={isNarrow(fields, field) || undefined}
          style={{ "--bits": colourOf(field) } as CSSProperties}
          data-field={field.name}
          data-lit={isLit(word, field, lit) || undefined}
          data-met={(isMet && asks(field)) || undefined}
          data-set={valueOf(word, field.name) !== 0 || undefined}
          aria-label={fieldMeaning(word, field, profile)}
          // The style sheet shows the bits: screen readers read out the meaning only.
          data-bits={bitsOf(word, field)}
          onClick={() => {
            onPlace({ row: index, field: at });
            leadToBlock(word, field);
          }}
          onPointerEnter={() => onPlace({ row: index, field: at })}
          onFocus={() => onPlace({ row: index, field: at })}
        />
      ))}
    </div>
  );
});

const clamp = (value: number, most: number) => Math.max(0, Math.min(most, value));
const NOTHING: ReadonlySet<string> = new Set();

function useLitBlocks(): { editor: EditorName | null; blocks: ReadonlySet<string> } {
  const selection = useStudio((studio) => studio.selection);
  if (!selection) return { editor: null, blocks: NOTHING };
  return { editor: selection.editor, blocks: withInner(selection.editor, selection.block) };
}

/** The first field that comes from these blocks; the old place where it comes from them too, or where none does. */
function placeOfBlocks(words: readonly CompiledWord[], editor: EditorName | null, blocks: ReadonlySet<string>, old: Place): Place {
  const firstLit = (word: CompiledWord | undefined) =>
    word && isOf(word, editor) ? fieldsOf(word).findIndex((field) => isLit(word, field, blocks)) : -1;
  const there = words[old.row];
  const field = there && fieldsOf(there)[old.field];
  if (there && isOf(there, editor) && field && isLit(there, field, blocks)) return old;
  const row = words.findIndex((word) => firstLit(word) >= 0);
  return row < 0 ? old : { row, field: firstLit(words[row]) };
}

const NO_LINES: ReadonlyMap<string, number> = new Map();

/** The line of each block in the Python text, on the level that shows the text. */
function useLines(): ReadonlyMap<string, number> {
  const shown = useSettings(({ level }) => level === "python");
  const places = usePython((python) => python.places);
  return useMemo(() => (shown ? new Map(places.map(({ block, line }) => [block, line])) : NO_LINES), [shown, places]);
}

/** The image's words. Arrow keys walk through its fields; Enter or a click leads to a field's block. */
export function WordTable({ words, profile }: { words: readonly CompiledWord[]; profile: Profile }) {
  const t = useTexts();
  const [place, setPlace] = useState<Place>({ row: 0, field: 0 });
  const scroller = useRef<HTMLDivElement>(null);
  const { first, last, height, offset, bringIntoView } = useRows(scroller, words.length);
  const { editor, blocks } = useLitBlocks();
  const selected = `${editor} ${[...blocks][0]}`;
  const [placedFor, setPlacedFor] = useState(selected);
  if (selected !== placedFor) {
    setPlacedFor(selected);
    setPlace(placeOfBlocks(words, editor, blocks, place));
  }
  const lines = useLines();
  const holds = useMat((now) => shownDecisions(now)?.holds);
  const row = clamp(place.row, words.length - 1);
  const word = words[row]!;
  const field = fieldsOf(word)[clamp(place.field, fieldsOf(word).length - 1)]!;

  useEffect(() => {
    const lit = words.findIndex((each) => hasBlockIn(each, blocks) && isOf(each, editor));
    if (lit >= 0) bringIntoView(lit);
    // Only a new selection scrolls: the table must not move when the words of a selection change.
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
    if (event.key === "Enter" || event.key === " ") leadToBlock(word, field);
    const step = steps[event.key];
    if (step || event.key === " ") event.preventDefault();
    if (!step) return;
    const nextRow = clamp(row + step[0], words.length - 1);
    const most = fieldsOf(words[nextRow]!).length - 1;
    bringIntoView(nextRow);
    setPlace({ row: nextRow, field: clamp(Math.min(place.field, most) + step[1], most), walked: true });
  };

  return (
    <>
      <div className={classes("printed-whole", css.scroller)} ref={scroller}>
        <div className={css.tableHead} aria-hidden="true">
          {spansOf(FORMATS.control).map(({ group, fields }, index) => (
            <span
              key={index}
              className={css.span}
              data-narrow={isNarrow(FORMATS.control, fields[0]!) || undefined}
              style={{ "--bits": fields.at(0)!.high - fields.at(-1)!.low + 1, "--gaps": fields.length - 1 } as CSSProperties}
            >
              <small>{t(`groups.${group}`)}</small>
            </span>
          ))}
        </div>
        <div role="grid" aria-label={t("words.table")} aria-rowcount={words.length} className={css.grid} style={{ height }} onKeyDown={walk}>
          <div role="rowgroup" style={{ transform: `translateY(${offset}px)` }}>
            {words.slice(first, last).map((each, index) => (
              <WordRow
                key={first + index}
                index={first + index}
                word={each}
                fields={fieldsOf(each)}
                profile={profile}
                line={lines.get(each.block ?? "")}
                lit={hasBlockIn(each, blocks) && isOf(each, editor) ? blocks : NOTHING}
                isMet={holds?.includes(first + index) ?? false}
                place={first + index === row ? place : null}
                onPlace={setPlace}
              />
            ))}
          </div>
        </div>
      </div>
      <Counters />
      <p className={classes("unprinted", css.detail)} aria-hidden="true">
        <b>{t("words.word", { index: row })}</b> {fieldMeaning(word, field, profile)}
      </p>
    </>
  );
}
