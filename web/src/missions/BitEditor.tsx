import type { CSSProperties } from "react";
import { ToggleButton } from "react-aria-components";
import { request } from "../api/service";
import type { CompiledWord, Field } from "../api/types";
import { FORMATS } from "../generated/steps";
import { useTexts } from "../i18n";
import { attempt } from "../projects/actions";
import { loadProject } from "../projects/project";
import { useStudio, useWords } from "../state/studio";
import { colourOf, isTold } from "../words/bits";
import css from "./missions.module.css";
import { classes } from "../ui/classes";

/** The fields that a pupil may flip: neither reserved bits nor the parity, which images write as 0. */
const FIELDS = FORMATS.control.filter(isTold);

/** Flip a bit of a word; the blocks of its part then say what the new word means, and those of the other one stay. */
async function flip(words: readonly CompiledWord[], place: number, bit: number): Promise<void> {
  await attempt(async () => {
    const flipped = words.map(({ hex }, k) => (parseInt(hex, 16) ^ (k === place ? 2 ** bit : 0)) >>> 0);
    const bytes = flipped.flatMap((word) => [24, 16, 8, 0].map((shift) => (word >>> shift) & 255));
    const { leader, followers } = await request("decompile", { image: btoa(String.fromCharCode(...bytes)) });
    const { rangeMm, ...project } = useStudio.getState();
    const changed = words[place]!.part === "leader" ? { leader } : { followers };
    loadProject({ ...project, python: null, range_mm: rangeMm, ...changed });
  });
}

/** The words of the program with a switch for each of their bits. */
export function BitEditor() {
  const t = useTexts();
  const words = useWords();
  return (
    <div className={classes("stack tight", css.bits)} role="group" aria-label={t("missions.bits")}>
      <p>{t("missions.byBits")}</p>
      {words.map((word, place) =>
        word.part === "header" ? null : (
          <div key={place} className={css.bitRow}>
            <span className="rigid small across">{t("missions.word", { number: place, part: t(`parts.${word.part}`) })}</span>
            {FIELDS.map((field) => (
              <Bits key={field.name} words={words} place={place} field={field} />
            ))}
          </div>
        ),
      )}
    </div>
  );
}

function Bits({ words, place, field }: { words: readonly CompiledWord[]; place: number; field: Field }) {
  const t = useTexts();
  const word = parseInt(words[place]!.hex, 16);
  const title = t(`fields.${field.name}`);
  return (
    <span className={css.field} title={title} style={{ "--bits": colourOf(field) } as CSSProperties}>
      {Array.from({ length: field.high - field.low + 1 }, (_, k) => field.high - k).map((bit) => {
        const value = Math.floor(word / 2 ** bit) % 2;
        return (
          <ToggleButton
            key={bit}
            className={css.bit}
            aria-label={t("missions.bit", { bit, title, value })}
            isSelected={value === 1}
            onChange={() => void flip(words, place, bit)}
          >
            {value}
          </ToggleButton>
        );
      })}
    </span>
  );
}
