import { useEffect } from "react";
import { useTranslation } from "react-i18next";
import type { CompiledWord } from "../api/types";
import { inLanguage } from "../i18n";
import { useStudio } from "../state/studio";
import { ToolButton } from "./fields";
import { MatCanvas } from "./MatCanvas";
import { Narration } from "./Narration";
import type { Session } from "./session";
import { choose, useMat } from "./store";
import { Transport } from "./Transport";
import css from "./mat.module.css";

const NO_WORDS: readonly CompiledWord[] = [];

/** The mat of the open project with the cars that run its program, and what lies over it. */
export function Stage({ session }: { session: Session }) {
  const words = useStudio(({ compiled }) => compiled?.words ?? NO_WORDS);
  const generation = useStudio((studio) => studio.generation);
  useEffect(() => choose(null), [generation]);
  return (
    <div className={css.stage}>
      <MatCanvas session={session} words={words} />
      <div className={css.top}>
        <Notice session={session} />
        <Narration session={session} />
      </div>
      <Transport session={session} words={words} />
    </div>
  );
}

function Notice({ session }: { session: Session }) {
  const { t } = useTranslation();
  const link = useMat((now) => now.link);
  const problem = useMat((now) => now.problem);
  const isLost = link === "lost" || link === "elsewhere";
  const text = isLost ? t(`mat.link.${link}`) : problem ? inLanguage(problem.sentence) : null;
  return (
    <div role="status">
      {text && (
        <p className={css.notice}>
          <span>{text}</span>
          {link === "elsewhere" && (
            <ToolButton icon="reset" wide label={t("mat.comeBack")} onPress={() => session.comeBack()} />
          )}
        </p>
      )}
    </div>
  );
}
