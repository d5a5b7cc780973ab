import { useEffect } from "react";
import { useTranslation } from "react-i18next";
import { useStudio } from "../app/store";
import { wordsShown } from "./compiling";
import { Diagnostics } from "./Diagnostics";
import { Gauge } from "./Gauge";
import { WordTable } from "./WordTable";

/** What the blocks are compiled to, with every change. */
export function WordsPanel() {
  const { t } = useTranslation();
  const compiled = useStudio((studio) => studio.compiled);
  const formats = useStudio((studio) => studio.formats);
  const profile = useStudio((studio) => studio.profileFigures);
  const followed = useStudio((studio) => studio.followers !== null);

  useEffect(wordsShown, [compiled]);

  return (
    <>
      <header className="pane-head">
        <h2 id="words-title">{t("words.title")}</h2>
        {compiled && (
          <div className="gauges">
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
      {compiled && compiled.diagnostics.length > 0 && <Diagnostics diagnostics={compiled.diagnostics} />}
      {compiled && compiled.words.length > 0 && formats && profile ? (
        <WordTable words={compiled.words} formats={formats} profile={profile} />
      ) : (
        <p className="words-empty">{t("words.none")}</p>
      )}
    </>
  );
}
