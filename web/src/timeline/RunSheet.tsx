/** A run on paper: the stage with the cars' tracks, whose it is, and the program's words. */

import { useState } from "react";
import { Input, Label, TextField } from "react-aria-components";
import { inLanguage, useTexts } from "../i18n";
import { useMat } from "../mat/store";
import { Stars } from "../missions/Stars";
import { useMission } from "../missions/store";
import { useSettings } from "../state/settings";
import { useStudio, useWords } from "../state/studio";
import { print, usePageState } from "../ui/panes";
import { classes } from "../ui/classes";
import { Sheet, TextButton } from "../ui/controls";
import { storyOf } from "../words/story";
import controls from "../ui/controls.module.css";
import css from "./timeline.module.css";

export function RunSheet() {
  const t = useTexts();
  // The stage as it is when the sheet opens.
  const [picture] = useState(() => useMat.getState().scene?.png() ?? "");
  const [by, setBy] = useState(useSettings.getState().userName ?? "");
  const { mission, result } = useMission();
  const name = useStudio((studio) => studio.name);
  const profile = useStudio((studio) => studio.profileFigures);
  const words = useWords();
  usePageState("print", "sheet");
  return (
    <Sheet title={mission ? inLanguage(mission.name) : name} wide>
      <TextField className={classes("wrap", "unprinted")} value={by} onChange={setBy} maxLength={60}>
        <Label>{t("run.name")}</Label>
        <Input />
      </TextField>
      <article className={css.run}>
        {by && <p className={css.by}>{by}</p>}
        {mission && result && <Stars stars={[...new Set(mission.goals.map(({ star }) => star))].sort()} earned={result.stars} />}
        <img src={picture} alt={t("run.stage")} />
        {profile && words.length > 0 && (
          <table>
            <thead>
              <tr>
                {(["part", "word", "story"] as const).map((column) => (
                  <th key={column} scope="col">
                    {t(`run.${column}`)}
                  </th>
                ))}
              </tr>
            </thead>
            <tbody>
              {words.map((word, k) => (
                <tr key={k}>
                  <td>{t(`run.${word.part}`)}</td>
                  <td className="mono">{word.hex.toUpperCase()}</td>
                  <td>{storyOf(word, profile)}</td>
                </tr>
              ))}
            </tbody>
          </table>
        )}
      </article>
      <footer className={controls.sheetFoot}>
        <TextButton primary onPress={print}>{t("run.print")}</TextButton>
      </footer>
    </Sheet>
  );
}
