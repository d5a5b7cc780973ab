import { memo, useEffect, useRef } from "react";
import { useTranslation } from "react-i18next";
import type { CompiledWord, Field, Profile } from "../api/types";
import { showBlock } from "../blocks/workspaces";
import { bitsOf, blockOf, groupOf, isLit } from "./bits";
import { fieldMeaning } from "./meaning";

/** Where in the table the user is. */
export interface Place {
  row: number;
  field: number;
  /** Got there by the keyboard: the focus follows. */
  walked?: boolean;
}

interface WordRowProps {
  index: number;
  word: CompiledWord;
  fields: readonly Field[];
  profile: Profile;
  lit: ReadonlySet<string>;
  /** The user's place where it is in this row. */
  place: Place | null;
  onPlace: (place: Place) => void;
}

/** To the block that a field comes from. */
export function leadToBlock(word: CompiledWord, field: string): void {
  const block = blockOf(word, field);
  if (word.part !== "header" && block) showBlock(word.part, block);
}

/** Made anew only where its word, or what is lit of it, changes: its many labels cost more than all the rest. */
export const WordRow = memo(function WordRow(props: WordRowProps) {
  const { index, word, fields, profile, lit, place, onPlace } = props;
  const { t } = useTranslation();
  const row = useRef<HTMLDivElement>(null);
  const active = place && Math.min(place.field, fields.length - 1);

  useEffect(() => {
    if (place?.walked) row.current?.querySelector<HTMLElement>('[tabindex="0"]')?.focus();
  }, [place]);

  return (
    <div role="row" aria-rowindex={index + 1} className="word" data-part={word.part} ref={row}>
      <span role="rowheader" className="word-name">
        <span className="word-index">{index}</span>
        <span className="word-hex">{word.hex.toUpperCase()}</span>
        <span className="visually-hidden">{t(`parts.${word.part}`)}</span>
      </span>
      {fields.map((field, at) => (
        <span
          key={field.name}
          role="gridcell"
          tabIndex={at === active ? 0 : -1}
          className={`field ${groupOf(field.name)}`}
          data-field={field.name}
          data-lit={isLit(word, field.name, lit) || undefined}
          data-set={(word.values[field.name] ?? 0) !== 0 || undefined}
          aria-label={fieldMeaning(word, field, profile)}
          // The style sheet shows the bits: read out, they would drown what they mean.
          data-bits={bitsOf(word, field)}
          onClick={() => {
            onPlace({ row: index, field: at });
            leadToBlock(word, field.name);
          }}
          onPointerEnter={() => onPlace({ row: index, field: at })}
          onFocus={() => onPlace({ row: index, field: at })}
        />
      ))}
    </div>
  );
});
