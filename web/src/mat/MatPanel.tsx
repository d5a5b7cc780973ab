import { useEffect, useState, memo } from "react";
import { Tab, TabList, TabPanel, Tabs, Button } from "react-aria-components";
import { useTranslation } from "react-i18next";
import type { CompiledWord } from "../api/types";
import { inLanguage } from "../i18n";
import { useStudio } from "../state/studio";
import { Timeline } from "../timeline/Timeline";
import { CarsPanel } from "./CarsPanel";
import { ToolButton, Choice } from "./fields";
import { Inspector } from "./Inspector";
import { MatCanvas } from "./MatCanvas";
import { Narration } from "./Narration";
import { Palette } from "./Palette";
import type { Scene } from "./scene";
import { Session } from "./session";
import { forgetEdits, redoEdit, undoEdit, useMat } from "./store";
import css from "./mat.module.css";
import { clock } from "../timeline/events";
import { Icon } from "../ui/icons";
import fields from "./fields.module.css";
import { classes } from "../ui/classes";

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

const SPEEDS = [0.25, 0.5, 1, 2, 4, 8, 16];
const FRACTIONS: Record<string, string> = { 0.25: "¼", 0.5: "½" };
/** A single step that can be seen: a tick is a millisecond. */
const STEP_MS = 100;

export const Transport = memo(function Transport({ session }: { session: Session }) {
  const { t } = useTranslation();
  const playing = useMat(({ state }) => state?.playing ?? false);
  const tMs = useMat((now) => now.tMs);
  const past = useMat((now) => now.past);
  const cars = useMat(({ hello }) => hello?.cars ?? 0);
  const tickMs = useMat(({ hello }) => hello?.tick_ms ?? 1);
  const empty = cars === 0;
  return (
    <div className={css.transport} role="group" aria-label={t("mat.transport")}>
      <Button
        id="mat-play"
        className={classes(fields.button, fields.main, fields.wide)}
        isDisabled={empty}
        onPress={() => (playing ? session.send({ do: "pause" }) : session.play())}
      >
        <Icon name={playing ? "pause" : "play"} />
        <span>{playing ? t("mat.pause") : t("mat.play")}</span>
      </Button>
      <ToolButton
        icon="step"
        label={t("mat.step")}
        isDisabled={empty}
        onPress={() => session.send({ do: "step", ticks: Math.max(1, Math.round(STEP_MS / tickMs)) })}
      />
      <ToolButton icon="reset" label={t("mat.reset")} isDisabled={empty} onPress={() => session.reset()} />
      <Speed session={session} />
      <output className={css.clock} data-past={past || undefined} aria-label={t("mat.time")}>
        {clock(tMs)}
      </output>
      <span className={css.say}>
        <VoiceButton session={session} word="stop" label={t("mat.sayStop")} text={t("mat.stop")} isDisabled={empty} />
        <VoiceButton session={session} word="go" label={t("mat.sayGo")} text={t("mat.go")} isDisabled={empty} />
      </span>
    </div>
  );
});

interface VoiceButtonProps {
  session: Session;
  word: "stop" | "go";
  label: string;
  text: string;
  isDisabled: boolean;
}

function VoiceButton({ session, word, label, text, isDisabled }: VoiceButtonProps) {
  return <ToolButton icon={word} label={label} wide={text} isDisabled={isDisabled} onPress={() => session.send({ do: "say", word })} />;
}

function Speed({ session }: { session: Session }) {
  const { t } = useTranslation();
  const speed = useMat((now) => now.speed);
  return (
    <Choice
      label={t("mat.speed")}
      value={String(speed)}
      all={SPEEDS.map(String)}
      name={(each) => `${FRACTIONS[each] ?? each}×`}
      onChange={(each) => session.setSpeed(Number(each))}
    />
  );
}
