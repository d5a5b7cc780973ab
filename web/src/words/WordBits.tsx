import type { CSSProperties } from "react";
import type { CompiledWord, Profile } from "../api/types";
import { colourOf, fieldMeaning, isTold, runsOf } from "./bits";
import css from "./words.module.css";

/** The upper half of a word is a row, and the lower one. */
const HALF = 16;

/** The 32 bits of one word in the colours of their fields, and below them what those say that are set. */
export function WordBits({ word, profile }: { word: CompiledWord; profile: Profile }) {
  const runs = runsOf(word);
  const told = runs.filter(({ field, isSet }) => isSet && isTold(field));
  return (
    <div className={css.bits}>
      {[runs.filter(({ field }) => field.low >= HALF), runs.filter(({ field }) => field.low < HALF)].map((half, k) => (
        <p key={k} aria-hidden="true">
          {half.map(({ field, bits, isSet }) => (
            <span
              key={field.name}
              className={css.field}
              style={{ "--bits": colourOf(field) } as CSSProperties}
              data-set={isSet || undefined}
              data-bits={bits}
              title={fieldMeaning(word, field, profile)}
            />
          ))}
        </p>
      ))}
      <ul>
        {told.map(({ field }) => (
          <li key={field.name} style={{ "--bits": colourOf(field) } as CSSProperties}>
            {fieldMeaning(word, field, profile)}
          </li>
        ))}
      </ul>
      <span className="unseen">{word.hex.toUpperCase()}</span>
    </div>
  );
}
