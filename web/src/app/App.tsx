import { type CSSProperties, lazy, useEffect, useRef, useState } from "react";
import { I18nProvider } from "react-aria-components";
import { Editors } from "../blocks/Editors";
import { Problems } from "../blocks/Problems";
import { setBlocklyLanguage } from "../blocks/definitions";
import { focusBlocks } from "../blocks/workspaces";
import { languageNow, useLanguage, useTexts, watchLanguage } from "../i18n";
import { session } from "../mat/session";
import { useDraft } from "../missions/draft";
import { MissionStrip } from "../missions/MissionStrip";
import { useMission } from "../missions/store";
import { SocketNotice } from "../ui/SocketNotice";
import { usePair } from "../pair/store";
import { attempt } from "../projects/actions";
import { useSettings } from "../state/settings";
import { useStudio } from "../state/studio";
import { Divider, Later } from "../ui/panes";
import { collectEdits } from "../words/compiling";
import { Dialogs, Notices, ServerBanner } from "./Dialogs";
import { Drawer } from "./Drawer";
import { Header } from "./Header";
import { openEditors, prepare, prepareEditors } from "./start";
import { Tour } from "./Tour";
import css from "./app.module.css";
import { endAll, watchSize } from "../ui/areas";
import areas from "../ui/areas.module.css";
import { classes } from "../ui/classes";

function SkipLinks() {
  const t = useTexts();
  return (
    <nav className={classes("unprinted", css.skipLinks)} aria-label={t("app.skip")}>
      <a
        href="#leader-blocks"
        onClick={(event) => {
          // A fragment alone wouldn't move Blockly's focus.
          event.preventDefault();
          focusBlocks();
        }}
      >
        {t("app.skipBlocks")}
      </a>
      <a href="#stage">{t("app.skipMat")}</a>
      <a href="#drawer">{t("app.skipDrawer")}</a>
    </nav>
  );
}

const PupilBar = lazy(async () => ({ default: (await import("../pupil/PupilBar")).PupilBar }));
const TeacherBar = lazy(async () => ({ default: (await import("../pupil/TeacherBar")).TeacherBar }));
const PairBar = lazy(async () => ({ default: (await import("../pair/PairBar")).PairBar }));
// Fetched at once: on a first visit nothing is seen before it.
const stage = import("../mat/Stage");
stage.catch(() => undefined);

/** The stage, as soon as it is there. `Suspense` would show it 300 ms later than what stands in its place. */
function LoadedStage() {
  const t = useTexts();
  const [loaded, setLoaded] = useState<Awaited<typeof stage> | null>(null);
  const [failure, setFailure] = useState<Error | null>(null);
  useEffect(() => void stage.then(setLoaded, setFailure), []);
  // The boundary around it shows that it can't be fetched.
  if (failure) throw failure;
  return loaded ? <loaded.Stage /> : <p className={classes("quiet", areas.loading)}>{t("app.loading")}</p>;
}

/** The stage, made after the rest of the page. */
function StageArea() {
  const t = useTexts();
  return (
    <section className={classes("unprinted", css.stageArea, areas.panel)} id="stage" tabIndex={-1} aria-label={t("mat.title")}>
      <Later>
        <LoadedStage />
      </Later>
    </section>
  );
}

function Work() {
  const t = useTexts();
  const language = useEditorsLanguage();
  const level = useSettings((settings) => settings.level);
  const kind = useStudio(({ profile, car }) => JSON.stringify([profile, car]));
  const alone = useStudio((studio) => studio.alone);
  const compiled = useStudio((studio) => studio.compiled !== null);
  const shares = useSettings((settings) => settings.shares);
  const isPlayed = useMission(({ mission }) => mission !== null);
  // Where the task stands in place of the blocks, there is room for the stage.
  const isRead = useMission(({ mission, folded }) => mission !== null && !folded);
  const isWritten = useDraft(({ draft }) => draft !== null);
  const drawer = useSettings((settings) => settings.drawer.open);
  const larger = useStudio((studio) => studio.larger);
  useEffect(() => {
    session.open();
    return () => session.close();
  }, []);
  const due = useEditorsDue();
  // The editors have been filled by then.
  useEffect(() => {
    if (due) openEditors();
  }, [due]);
  return (
    <main
      className={classes("printed-whole", css.work)}
      data-alone={alone ?? undefined}
      data-drawer={drawer || undefined}
      data-larger={isRead ? undefined : larger}
      data-compiled={compiled || undefined}
      data-task={isPlayed || isWritten || undefined}
    >
      <div className={classes("printed-whole", css.blocks)}>
        <MissionStrip />
        {due ? <Editors key={`${language} ${level} ${kind}`} /> : <p className={classes("quiet", areas.loading)}>{t("app.loading")}</p>}
        <Problems />
      </div>
      <Divider
        label={t("app.divider")}
        orientation="vertical"
        share={shares.blocks}
        onShare={(blocks) => useSettings.setState({ shares: { ...shares, blocks } })}
      />
      <StageArea />
      <Drawer />
    </main>
  );
}

/** A stage that isn't drawn, as in a tab that nobody sees, lets the editors wait no longer. */
const LATEST_EDITORS_MS = 4000;

/** Whether it is time to make the editors: in what a first visit finds, once its cars are seen to drive. */
function useEditorsDue(): boolean {
  const [due, setDue] = useState(() => !useStudio.getState().isOpening);
  useEffect(() => {
    if (due) return;
    const make = () => {
      prepareEditors();
      setDue(true);
    };
    const timer = setTimeout(make, LATEST_EDITORS_MS);
    // Another project may be opened before.
    const stop = useStudio.subscribe(({ isOpening }) => isOpening || make());
    void session.drawn.then(make);
    return endAll(stop, () => clearTimeout(timer));
  }, [due]);
  return due;
}

/** The language of the editors, which are created anew once Blockly has its messages in another one. */
function useEditorsLanguage(): string {
  const [language, setLanguage] = useState(languageNow);
  useEffect(
    () =>
      watchLanguage(() => {
        setBlocklyLanguage();
        collectEdits();
        setLanguage(languageNow());
      }),
    [],
  );
  return language;
}

export function App() {
  const t = useTexts();
  const language = useLanguage();
  const [ready, setReady] = useState(false);
  const gone = useStudio(({ service }) => service === "gone");
  const alone = useStudio((studio) => studio.alone);
  const share = useSettings((settings) => settings.shares.blocks);
  const classroom = useStudio(({ capabilities }) => capabilities?.classroom);
  const isPair = usePair(({ view }) => view !== null);
  const bars = useRef<HTMLDivElement>(null);
  // What lies over the page below them keeps off them.
  useEffect(() => watchSize(bars.current!, () => document.documentElement.style.setProperty("--bars", `${bars.current!.clientHeight}px`)), []);
  useEffect(() => {
    if (!ready && !gone) void attempt(prepare).then(() => setReady(useStudio.getState().generation > 0));
  }, [ready, gone]);
  return (
    // Numbers and units follow the page's language, not the browser's.
    <I18nProvider locale={language}>
      <div className={classes("printed-whole", css.app)} data-alone={alone ?? undefined} style={{ "--share": share } as CSSProperties}>
        <SkipLinks />
        <Header />
        <div ref={bars}>
          <ServerBanner />
          <SocketNotice />
          {ready && (
            <Later>
              {isPair && <PairBar />}
              {classroom === "pupil" && <PupilBar />}
              {classroom === "teacher" && <TeacherBar />}
            </Later>
          )}
        </div>
        {ready ? <Work /> : <p className={classes("quiet", areas.loading)}>{t("app.loading")}</p>}
        {ready && <Tour />}
        <Dialogs />
        <Notices />
      </div>
    </I18nProvider>
  );
}
