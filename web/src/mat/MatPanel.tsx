import "./mat.css";
import "./controls.css";
import "./inspector.css";
import { useEffect, useRef, useState } from "react";
import { Tab, TabList, TabPanel, Tabs } from "react-aria-components";
import { useTranslation } from "react-i18next";
import type { CompiledWord, EditorName, MatDocument } from "../api/types";
import { inLanguage } from "../i18n";
import { Timeline } from "../timeline/Timeline";
import { Account } from "./Account";
import { asMat } from "./document";
import { Inspector } from "./Inspector";
import { MatCanvas } from "./MatCanvas";
import { Palette } from "./Palette";
import type { Scene } from "./scene";
import { Session } from "./session";
import { loadMat, redoEdit, undoEdit, useMat } from "./store";
import { Swarm } from "./Swarm";
import { ToolButton } from "./ToolButton";
import { Transport } from "./Transport";

export interface MatPanelProps {
  /** The compiled image in base64; null while the blocks have an error: the cars stand still. */
  image: string | null;
  /** The image's words, in its order; each tells its block. */
  words: readonly CompiledWord[];
  mat: MatDocument;
  /** How far infrared reaches on it, in millimetres; null: as far as the profile says. */
  rangeMm: number | null;
  onChange: (mat: MatDocument, rangeMm: number | null) => void;
  /** The profile's name. */
  profile: string;
  /** Called with the ids of the blocks that run now, where they changed. */
  onRunning: (running: ReadonlyMap<EditorName, readonly string[]>) => void;
}

const SAVED_MS = 250;
const PANELS = ["swarm", "things", "timeline"] as const;

/** The panel's document is the project's, whichever of the two changed last. */
function useProjectMat({ mat, rangeMm, onChange }: MatPanelProps, session: Session) {
  const known = useRef<{ mat: MatDocument; rangeMm: number | null } | null>(null);
  const tell = useRef(onChange);
  useEffect(() => {
    tell.current = onChange;
  }, [onChange]);

  useEffect(() => {
    if (mat === known.current?.mat && rangeMm === known.current.rangeMm) return;
    if (mat !== known.current?.mat) loadMat(asMat(mat));
    known.current = { mat, rangeMm };
    useMat.setState({ rangeMm });
  }, [mat, rangeMm]);

  useEffect(() => {
    let timer: ReturnType<typeof setTimeout> | undefined;
    const save = () => {
      clearTimeout(timer);
      const edited = useMat.getState();
      if (edited.mat === known.current?.mat && edited.rangeMm === known.current.rangeMm) return;
      known.current = { mat: edited.mat, rangeMm: edited.rangeMm };
      tell.current(edited.mat, edited.rangeMm);
    };
    const end = useMat.subscribe((now, before) => {
      if (now.mat === before.mat && now.rangeMm === before.rangeMm) return;
      session.sync();
      clearTimeout(timer);
      timer = setTimeout(save, SAVED_MS);
    });
    return () => {
      end();
      save();
    };
  }, [session]);
}

function useSession({ image, words, profile, onRunning }: MatPanelProps): Session {
  const [session] = useState(() => new Session());
  useEffect(() => {
    session.open();
    return () => session.close();
  }, [session]);
  useEffect(() => session.setProgram({ image, words, profile }), [session, image, words, profile]);
  useEffect(() => session.tellRunning(onRunning), [session, onRunning]);
  return session;
}

export function MatPanel(props: MatPanelProps) {
  const session = useSession(props);
  useProjectMat(props, session);
  const [scene, setScene] = useState<Scene | null>(null);
  return (
    <div className="mat-panel">
      <Transport session={session} />
      <div className="mat-stage">
        <Notice session={session} />
        <Palette session={session} scene={scene} />
        <MatCanvas session={session} words={props.words} onScene={setScene} />
        <History />
      </div>
      <Account session={session} />
      <Panels session={session} words={props.words} />
    </div>
  );
}

function History() {
  const { t } = useTranslation();
  const undos = useMat((now) => now.undo.length);
  const redos = useMat((now) => now.redo.length);
  return (
    <div className="mat-history">
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
        <p className="mat-notice">
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
    <Tabs className="mat-tabs" selectedKey={panel} onSelectionChange={(key) => setPanel(String(key))}>
      <TabList className="mat-tablist" aria-label={t("mat.panels.title")}>
        {PANELS.map((each) => (
          <Tab key={each} id={each} className="mat-tab">
            {t(`mat.panels.${each}`)}
          </Tab>
        ))}
      </TabList>
      <TabPanel id="swarm" className="mat-tabpanel">
        <Swarm session={session} />
      </TabPanel>
      <TabPanel id="things" className="mat-tabpanel">
        <Inspector session={session} words={words} />
      </TabPanel>
      <TabPanel id="timeline" className="mat-tabpanel">
        <Timeline session={session} words={words} />
      </TabPanel>
    </Tabs>
  );
}
