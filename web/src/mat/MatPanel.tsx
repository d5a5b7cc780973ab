import { useEffect, useState } from "react";
import { Tab, TabList, TabPanel, Tabs } from "react-aria-components";
import { useTranslation } from "react-i18next";
import type { CompiledWord } from "../api/types";
import { inLanguage } from "../i18n";
import { useStudio } from "../state/studio";
import { Timeline } from "../timeline/Timeline";
import { CarsPanel } from "./CarsPanel";
import { ToolButton } from "./fields";
import { Inspector } from "./Inspector";
import { MatCanvas } from "./MatCanvas";
import { Narration } from "./Narration";
import { Palette } from "./Palette";
import type { Scene } from "./scene";
import { Session } from "./session";
import { forgetEdits, redoEdit, undoEdit, useMat } from "./store";
import { Transport } from "./Transport";
import css from "./mat.module.css";

const PANELS = ["swarm", "things", "timeline"] as const;
const NO_WORDS: readonly CompiledWord[] = [];

/** The mat of the open project: the cars that run its program, and the tools around them. */
export function MatPanel() {
  const [session] = useState(() => new Session());
  const [scene, setScene] = useState<Scene | null>(null);
  const words = useStudio(({ compiled }) => compiled?.words ?? NO_WORDS);
  const generation = useStudio((studio) => studio.generation);
  useEffect(() => {
    session.open();
    return () => session.close();
  }, [session]);
  useEffect(forgetEdits, [generation]);
  return (
    <div className={css.panel}>
      <Transport session={session} />
      <div className={css.view}>
        <Notice session={session} />
        <Palette session={session} scene={scene} />
        <MatCanvas session={session} words={words} onScene={setScene} />
        <History />
      </div>
      <Narration session={session} />
      <Panels session={session} words={words} />
    </div>
  );
}

function History() {
  const { t } = useTranslation();
  const undos = useMat((now) => now.undo.length);
  const redos = useMat((now) => now.redo.length);
  return (
    <div className={css.history}>
      <ToolButton icon="undo" label={t("mat.undo")} isDisabled={!undos} onPress={undoEdit} />
      <ToolButton icon="redo" label={t("mat.redo")} isDisabled={!redos} onPress={redoEdit} />
    </div>
  );
}

function Notice({ session }: { session: Session }) {
  const { t } = useTranslation();
  const link = useMat((now) => now.link);
  const problem = useMat((now) => now.problem);
  const compiling = useMat((now) => now.compiling);
  const isLost = link === "lost" || link === "elsewhere";
  const waits = compiling ? t("mat.compiling") : null;
  const text = isLost ? t(`mat.link.${link}`) : problem ? inLanguage(problem.sentence) : waits;
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

function Panels({ session, words }: { session: Session; words: readonly CompiledWord[] }) {
  const { t } = useTranslation();
  const [panel, setPanel] = useState<string>("swarm");
  const chosen = useMat((now) => now.chosen);
  const [shownFor, setShownFor] = useState(chosen);
  if (chosen !== shownFor) {
    setShownFor(chosen);
    if (chosen && panel === "swarm") setPanel("things");
  }
  return (
    <Tabs className={css.tabs} selectedKey={panel} onSelectionChange={(key) => setPanel(String(key))}>
      <TabList className={css.tablist} aria-label={t("mat.panels.title")}>
        {PANELS.map((each) => (
          <Tab key={each} id={each} className={css.tab}>
            {t(`mat.panels.${each}`)}
          </Tab>
        ))}
      </TabList>
      <TabPanel id="swarm" className={css.tabpanel}>
        <CarsPanel session={session} />
      </TabPanel>
      <TabPanel id="things" className={css.tabpanel}>
        <Inspector session={session} words={words} />
      </TabPanel>
      <TabPanel id="timeline" className={css.tabpanel}>
        <Timeline session={session} words={words} />
      </TabPanel>
    </Tabs>
  );
}
